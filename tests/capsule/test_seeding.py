from capsule.seeding import generator


def test_a_stream_belongs_to_its_seed_and_names():
    def first(seed, *names):
        return generator(seed, *names).integers(2**62)

    assert first(1, "fit", "3mm/r07") == first(1, "fit", "3mm/r07")
    others = {first(2, "fit", "3mm/r07"), first(1, "fit", "3mm/r08"), first(1, "fit3mm/r07")}
    assert first(1, "fit", "3mm/r07") not in others
    assert len(others) == 3
