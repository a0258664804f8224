"""The Lab Streaming Layer, imported only if an option asks for a stream."""

from types import ModuleType

from capsule.bench.bench_errors import AcquisitionError
from capsule.project import how_to_install

EXTRA = how_to_install("lsl")


def import_pylsl(option: str) -> ModuleType:
    """Import pylsl for an option; raise `AcquisitionError` if that fails."""
    try:
        import pylsl
    except ModuleNotFoundError:
        raise AcquisitionError(
            f"{option} needs pylsl, which is not installed; run {EXTRA}"
        ) from None
    except (RuntimeError, OSError) as fault:
        # pylsl is there, but the library liblsl that it loads is not.
        reason = str(fault).partition("\n")[0]
        raise AcquisitionError(
            f"{option} needs the library liblsl, which pylsl cannot load ({reason}); install it "
            "from github.com/sccn/liblsl/releases, or with: conda install -c conda-forge liblsl"
        ) from None
    layer: ModuleType = pylsl
    return layer
