//!  profiles, interface length and mismatch energies.
