import numpy as np

from capsule.seeding import fit_generator, generator


def test_a_stream_belongs_to_its_seed_and_names():
    def first(seed, *names):
        return generator(seed, *names).integers(2**62)

    assert first(1, "roc", "3mm/r07") == first(1, "roc", "3mm/r07")
    others = {first(2, "roc", "3mm/r07"), first(1, "roc", "3mm/r08"), first(1, "roc3mm/r07")}
    assert first(1, "roc", "3mm/r07") not in others
    assert len(others) == 3


def test_a_fit_is_seeded_by_the_readings_and_the_seed():
    def first(seed, values):
        return fit_generator(seed, values).integers(2**62)

    values = np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]])
    other = values.copy()
    other[1, 2] += 1.0
    assert first(1, values) == first(1, values.copy())
    assert len({first(1, values), first(2, values), first(1, other)}) == 3
