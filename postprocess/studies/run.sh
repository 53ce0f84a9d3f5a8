#!/bin/sh
# The shipped studies. Each command goes on where it was cut, and only draws again what is done:
#     sh postprocess/studies/run.sh OUTPUT_FOLDER
# What they measured is in results/ beside this file, with date, versions and machine in the JSON files.
set -eu
here=$(dirname "$0")
out=${1:?the folder for the runs}
study() { name=$1; shift; echo "== $name"; ibfil "$@" -o "$out/$name" || [ $? -eq 1 ]; }

# Error against wall time: three implicit schemes from 20 to 640 steps a period, and explicit Euler below and above 1.9e-5.
# The step of the case is that of the coarsest reference level.
study swimmer_trade trade swimmer_stokes output.grid_every=1.885 time.step=0.0031416 output.every=0.031416 --vary \
'time.scheme=implicit,implicit,implicit,implicit,implicit,implicit,implicit,implicit,implicit,implicit,semi-implicit,semi-implicit,semi-implicit,semi-implicit,semi-implicit,explicit,explicit&time.order=2,2,2,2,2,1,1,1,1,1,1,1,1,1,1,1,1&time.step=0.031416,0.015708,0.007854,0.003927,0.0019635,0.031416,0.015708,0.007854,0.003927,0.0019635,0.031416,0.015708,0.007854,0.003927,0.0019635,0.0001,0.000018' \
    --observe position,speed --clock processor

# Ways to the same velocity, and how nodes are placed: kernels, precision, method.
study method_trade trade swimmer_stokes output.grid_every=1.885 'fluid.cells=[64,64,64]' filament.swimmer.nodes=21 output.every=0.031416 \
    --vary fluid.method=table,pruned,krylov,fft --vary time.step=0.031416,0.015708,0.007854 --observe position,speed --clock processor

# One swimmer under four fluids, on a grid that is right.
study swimmer_compare compare swimmer_stokes fluid.density=1 time.end=2.51328 output.grid_every=2.51328 --fluids rft,matched,stokes,navier-stokes

# A clamped rod bends in shear flow.
study shear_compare compare "$here/shear.toml" --fluids rft,slender,matched,stokes

# Thrust of a helix over pitch: resistive-force theory against the grid.
for pitch in 2 2.5 5 10; do
    study "helix_pitch_$pitch" compare "$here/helix.toml" parameters.pitch=$pitch --fluids rft,slender,stokes
done

# Whirling: the growth rate changes sign at 8.865 A/(zeta_r L^2); and what step its growth needs.
study whirling_sweep sweep whirling time.end=30 --vary parameters.ratio=8.6,8.8,8.9,9.0,9.2
study whirling_trade trade whirling time.end=10 'observe.growth.over=[5,10]' 'observe.whirl.over=[5,10]' filament.rod.nodes=49 \
    --vary time.order=1,2 --vary time.step=0.016,0.008,0.004,0.002 --observe growth,whirl --clock processor

# Four cilia in a row on a wall: what they pump over the phase between neighbours.
study cilia_phase sweep cilia_row \
    --vary parameters.lag=-3.1416,-2.3562,-1.9635,-1.5708,-1.1781,-0.7854,-0.3927,0,0.3927,0.7854,1.1781,1.5708,2.3562,3.1416
python "$here/flux_over_phase.py" "$out/cilia_phase/sweep.csv" "$out/cilia_phase/sweep.png"

# The paper's own grid locks without slip: nodes h/2 apart. Slip, or cells no larger than the nodes are apart, cure it.
study locking stability swimmer_locked time.end=0.6283 time.step=0.0125664 output.every=0.0628318 \
    --vary fluid.slip=0,1e-4,1e-3,0.01 --vary 'fluid.cells=[48,48,48],[64,64,64],[96,96,96],[128,128,128]'
# And where the explicit scheme ends: 2/rho(M K) falls as the fourth power of the nodes' distance.
study explicit stability swimmer_rft time.end=0.01 output.every=0.002 time.scheme=explicit time.order=1 \
    'observe.speed.over=[0,0.01]' 'observe.sideways.over=[0,0.01]' \
    --vary filament.swimmer.nodes=11,16,21,31,41 --vary time.step=1e-4,3e-5,1e-5,3e-6,1e-6,3e-7
# Growth that a scheme hides or makes up, foretold from the spectrum: a rod above its flutter, which grows at 4.48.
study flailing_stability stability flailing parameters.F0=45 filament.rod.nodes=33 time.end=2.048 output.every=0.032 \
    'observe.growth.over=[0.5,1]' 'observe.frequency.over=[0.5,1]' \
    --vary 'time.scheme=implicit,implicit,semi-implicit&time.order=2,1,1' --vary time.step=0.001,0.002,0.004,0.008,0.016,0.032

# Bending modulus, amplitude and bend at rest of a fibre from its tracked shapes, which tracked.py made: the truth is that of whip.toml.
study whip_fit fit "$here/whip.toml" parameters.bending=300 parameters.amplitude=1.2 parameters.bend=0 --vary parameters.bending=10,1000 \
    --vary parameters.amplitude=0.5,5 --vary parameters.bend=-0.1,0.1 --data "$here/tracked.csv"

# An error bar on the swimmer's speed, and where it comes from.
study swimmer_uncertainty uncertainty swimmer_stokes --meant

# The cheapest step and nodes: for growth and frequency of a flailing rod, for the speed of the swimmer.
study flailing_tune tune flailing --for growth=5% --for frequency=1%
study swimmer_tune tune swimmer_stokes --for speed=2%

# What a head costs a sperm cell, by its radius. heads.py draws them together.
study head_none compare "$here/head.toml" body=absent filament.tail.start=absent --fluids rft,matched,free,stokes
study head_0.075 compare "$here/head.toml" parameters.head=0.075 --fluids rft,matched,free,stokes
study head_0.1 compare "$here/head.toml" parameters.head=0.1 --fluids rft,matched,free,stokes
study head_0.15 compare "$here/head.toml" parameters.head=0.15 --fluids rft,matched,free,stokes
study head_0.2 compare "$here/head.toml" parameters.head=0.2 --fluids rft,matched,free,stokes

# Flutter of a clamped rod under a follower force: the threshold in resistive-force theory, and on grids in free space and in a box,
# of rods 18, 27 and 36 hydrodynamic radii long. flutter.py draws them together.
study flutter_rft modes "$here/flutter.toml" fluid.model=rft fluid.box=absent fluid.thickness=absent --critical parameters.F0=24,40
study flutter_free_18 modes "$here/flutter.toml" filament.rod.nodes=21 fluid.box=free fluid.thickness=0.05555555555555555 \
    --critical parameters.F0=24,40
study flutter_free_27 modes "$here/flutter.toml" filament.rod.nodes=31 fluid.box=free fluid.thickness=0.037037037037037035 \
    --critical parameters.F0=24,40
study flutter_free_36 modes "$here/flutter.toml" filament.rod.nodes=41 fluid.box=free fluid.thickness=0.027777777777777776 \
    --critical parameters.F0=24,40
study flutter_box_18 modes "$here/flutter.toml" filament.rod.nodes=21 fluid.thickness=0.05555555555555555 \
    --critical parameters.F0=24,40
study flutter_box_27 modes "$here/flutter.toml" filament.rod.nodes=31 fluid.thickness=0.037037037037037035 \
    --critical parameters.F0=24,40
study flutter_box_36 modes "$here/flutter.toml" filament.rod.nodes=41 fluid.thickness=0.027777777777777776 \
    --critical parameters.F0=24,40
