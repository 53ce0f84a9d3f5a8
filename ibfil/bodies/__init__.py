"""Bodies that rods are attached to: their motion, the ends they carry, and the balance of force and torque."""
