"""The smallest distance of a particle from a recording, by the library's comparison."""

from capsule.method.sliding import RepeatedParticle, SlidingComparison, rmse_at_lag


def smallest_rmse(matrix, particle):
    """Return the smallest RMSE over all lags, and its lag (eq. RMSEmin)."""
    _, lag = SlidingComparison(matrix).gain_of(RepeatedParticle(particle))
    return rmse_at_lag(matrix, particle, lag), lag
