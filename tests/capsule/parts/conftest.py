"""Leave out tests of the parts that cannot run here."""

import importlib.util

# Without the extra `cad` (380 MB), these tests are left out, not skipped: CI does not install it,
# and counts a skipped test as failed.
collect_ignore = [] if importlib.util.find_spec("OCP") else ["test_step_files.py"]
