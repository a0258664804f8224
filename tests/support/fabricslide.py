"""Import recordings of a tactile finger on a board of ridges (wngfra/FabricSlide, MIT).

The files are in tests/data/fabricslide/ with their licence. They have 16 channels and a time stamp
in ms. A lab.yaml is enough to import them.
"""

from pathlib import Path

from support.importing import Imported, import_files
from support.project import ROOT

FOLDER = Path(__file__).parents[1] / "data" / "fabricslide"
MAP = ROOT / "docs" / "examples" / "fabricslide.yaml"


def import_boards(folder: Path, size: int, config: Path) -> Imported:
    """Import the recordings of a board, with ridges of 2 or 10 mm, into `folder`/raw."""
    files = sorted(FOLDER.glob(f"Board{size}mm_*.csv"))
    return import_files(folder, *files, "--map", MAP, "--config", config, size=str(size))
