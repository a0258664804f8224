"""A physical model of the paper's bench: phantom gut, capsule, sensors and electronics."""
