"""Names of the recordings in the report that tests open in a browser."""

SIZES = (0, 1, 2.5, 6)
RECORDINGS = [f"{size}mm/r{run:02d}" for size in SIZES for run in (1, 2, 3)] + ["unlabelled/u1"]
EVIL = "<script>document.title='broken'</script><img src=x onerror=\"document.title='broken'\">"
