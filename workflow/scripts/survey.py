"""Survey a gut: go back to each suspected nodule, and test it again."""

from capsule import files
from capsule.bench import output, survey_options, surveys
from capsule.bench.bench_errors import end_with_status


def main() -> None:
    """Run a survey; each fault has its own exit status."""
    with end_with_status():
        surveys.survey(survey_options.parse())


if __name__ == "__main__":
    output.install()
    files.run(main)
