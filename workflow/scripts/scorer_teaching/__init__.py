"""Teaching the scorer of the detector ``taught`` by simulated recordings of many random benches."""
