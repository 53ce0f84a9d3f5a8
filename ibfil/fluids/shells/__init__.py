"""Bodies in a fluid that nodes push through a discrete delta kernel: shells of markers, which move rigidly."""
