"""From the [body] tables of a case to bodies and motors: ends of rods in them, supports, and which are one swimmer."""
