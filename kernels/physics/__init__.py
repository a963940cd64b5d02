"""One link or one joint a call: forces, geometry, energies."""
