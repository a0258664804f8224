"""Survey a gut: go back to what looks like a nodule, and look again."""

import sys

from acquisition import output, survey_options, surveys
from acquisition.bench_errors import AcquisitionError
from edges import files


def main() -> None:
    """Survey; each fault has its own exit status."""
    try:
        surveys.survey(survey_options.parse())
    except AcquisitionError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.status)
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    output.install()
    files.run(main)
