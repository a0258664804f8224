"""Training of the scorer of the detector ``taught`` on simulated recordings of random benches."""
