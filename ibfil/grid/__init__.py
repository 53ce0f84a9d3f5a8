"""The periodic grid: points, delta kernels, spreading and interpolation, transforms, the solve mode by mode."""
