# Write the report.
#
# takes: all results but results/signals/, results/best_places/ and results/features/
# gives: results/report.html

LISTED_SURVEYS = {"names": SURVEYS.names, "passed_over": SURVEYS.passed_over}
# The page is made from these templates, and shows the paper's numbers from these tables.
IN_REPORT = filter(Path.is_file, sorted(REPORT_FILES.rglob("[!.]*")))
PAGE_FILES = [path for path in IN_REPORT if path.parent.name != "captions"]
REPORT = step(
    "report",
    # The number of recordings that one job takes changes no result, and is not on the page.
    sections(*(config.keys() - {"recordings_per_job"}), surveys=LISTED_SURVEYS),
    lambda _: [
        DETECT.key(),
        DRAW.key(),
        *map(PLOT.key, DESCRIBED),
        *map(SURVEY.key, SURVEYS.names),
    ],
    modules=sorted({*DETECTOR_MODULES, *FIGURES.values()}),
    beside=[*PAGE_FILES, SCHEMA],
)


rule report:
    input:
        recordings=rules.list.output,
        templates=rules.templates.output.parameters,
        evaluation=rules.evaluate.output,
        detections=[rules.detect.output.detections, rules.detect.output.sites],
        figures=rules.draw.output,
        surveys=expand(rules.survey.output, survey=SURVEYS.names),
        plot_data=each("plot", DESCRIBED),
        matrices=each("preprocess", BATCHES, "matrices"),
        fits=each("fit", NODULES),
    output:
        shown("results/report.html", "report", "Report"),
    log:
        "results/logs/report.log",
    conda:
        "../environment.yml"
    params:
        **told(REPORT),
    message:
        "write the report"
    shell:
        "python {params.script:q} --results {params.results:q}"
        " --settings {params.settings:q} --key {params.key} --output {output:q}"
        " > {log:q} 2>&1"
