import numpy as np

from capsule.seeding import fit_generator, generator


def test_a_stream_belongs_to_its_seed_and_names_and_that_of_a_fit_to_its_readings():
    values = np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]])

    def streams():
        yield generator(1, "roc", "3mm/r07")
        yield from (generator(2, "roc", "3mm/r07"), generator(1, "roc", "3mm/r08"))
        yield generator(1, "roc3mm/r07")
        yield from (
            fit_generator(1, values),
            fit_generator(2, values),
            fit_generator(1, values + 1),
        )

    first = [stream.integers(2**62) for stream in streams()]
    assert first == [stream.integers(2**62) for stream in streams()]
    assert len(set(first)) == 7
