"""Export recordings and results for other programs."""

from functools import partial

from capsule import files
from capsule.exporting.export_options import read_arguments
from capsule.exporting.export_provenance import outdated
from capsule.exporting.export_writing import tell, write
from capsule.exporting.gathering import gather
from capsule.settings import read_settings
from capsule.words import plural


def main() -> None:
    """Read the results, and write them in the chosen format."""
    arguments = read_arguments()
    settings = read_settings(arguments.config)
    progress = partial(tell, what="recordings read:")
    exported = gather(arguments.results, arguments.config, settings, arguments.what, progress)
    count, written = write(exported, arguments.format, arguments.out, force=arguments.force)
    if changed := outdated(arguments.results, settings):
        print(
            f"warning: {plural(len(changed), 'recording')} came, went or changed since "
            f"{arguments.results}/ was made, such as {changed[0]}; make it again: "
            "snakemake -c2 results/report.html"
        )
    origin = exported.provenance["origin"]
    files_written = "1 file" if count == 1 else f"{count} files"
    print(f"{files_written}, {written / 1e6:.1f} MB in {arguments.out}/; recordings: {origin}")


if __name__ == "__main__":
    files.run(main)
