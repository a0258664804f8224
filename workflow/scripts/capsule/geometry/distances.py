"""Compute distances between outlines, and detect crossings."""

import numpy as np

from capsule.arrays import BoolArray, FloatArray


def _edges(polygon: FloatArray) -> tuple[FloatArray, FloatArray]:
    return polygon, np.roll(polygon, -1, axis=0)


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]


def _crossings(first: FloatArray, second: FloatArray) -> BoolArray:
    """Return whether each edge of one polygon crosses each of the other: shape (N, M), of bool."""
    start, end = (each[:, np.newaxis] for each in _edges(first))
    other_start, other_end = (each[np.newaxis] for each in _edges(second))
    way, other_way = end - start, other_end - other_start
    apart = _cross(way, other_start - start) * _cross(way, other_end - start) < 0
    other_apart = _cross(other_way, start - other_start) * _cross(other_way, end - other_start) < 0
    return apart & other_apart


def crosses_itself(polygon: FloatArray) -> bool:
    """Return whether two edges of a polygon cross.

    Parameters
    ----------
    polygon
        The polygon's corners in order, shape (N, 2).
    """
    return bool(_crossings(polygon, polygon).any())


def cross(first: FloatArray, second: FloatArray) -> bool:
    """Return whether an edge of one polygon crosses an edge of the other."""
    return bool(_crossings(first, second).any())


def _to_edges(points: FloatArray, polygon: FloatArray) -> float:
    start, end = _edges(polygon)
    way = end - start
    squared = np.maximum((way**2).sum(axis=1), 1e-18)
    steps = ((points[:, np.newaxis] - start) * way).sum(axis=2) / squared
    nearest = start + np.clip(steps, 0.0, 1.0)[..., np.newaxis] * way
    return float(np.linalg.norm(points[:, np.newaxis] - nearest, axis=2).min())


def contains(polygon: FloatArray, point: FloatArray) -> bool:
    """Return whether a point is inside a polygon (a ray to the right crosses it an odd number)."""
    start, end = _edges(polygon)
    spans = (start[:, 1] > point[1]) != (end[:, 1] > point[1])
    rise = np.where(spans, end[:, 1] - start[:, 1], 1.0)
    at = start[:, 0] + (point[1] - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
    return bool((spans & (at > point[0])).sum() % 2)


def gap(first: FloatArray, second: FloatArray) -> float:
    """Return the distance between two polygons, in mm; -1 if they overlap."""
    overlap = cross(first, second) or contains(first, second[0]) or contains(second, first[0])
    if overlap:
        return -1.0
    return min(_to_edges(first, second), _to_edges(second, first))
