"""The capsule's library: pure functions on arrays, from a recording to a verdict."""
