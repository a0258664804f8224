# Write the report.
#
# takes: all results; the files of each recording are made before the lists and the templates
# gives: results/report.html

LISTED_SURVEYS = {"names": SURVEYS.names, "passed_over": SURVEYS.passed_over}
# The page is made from these templates, and shows the paper's numbers from these tables.
PAGE_FILES = [
    path
    for path in sorted(REPORT_FILES.rglob("[!.]*"))
    if path.is_file() and path.parent.name != "captions"
]
REPORT = step(
    "report",
    # The number of recordings that one job takes changes no result, and is not on the page.
    sections(*(config.keys() - {"recordings_per_job"}), surveys=LISTED_SURVEYS),
    lambda _: [DETECT.key(), DRAW.key(), *keys_of(SURVEY, SURVEYS.names)],
    modules=sorted({*DETECTOR_MODULES, *(row.module for row in FIGURES.values())}),
    beside=[*PAGE_FILES, SCHEMA],
)


rule report:
    input:
        recordings=rules.list.output,
        templates=rules.templates.output,
        evaluation=rules.evaluate.output,
        detections=rules.detect.output,
        figures=rules.draw.output,
        surveys=expand(rules.survey.output, survey=SURVEYS.names),
        plot_data=each("describe", DESCRIBED, "plot_data"),
    output:
        shown("results/report.html", "report", "Report"),
    log:
        "results/logs/report.log",
    conda:
        "../../environment.yml"
    # As for evaluate; here a second process gains something later.
    threads: 2 if len(ARCHIVE.recordings) >= 5000 else 1
    params:
        **told(REPORT),
    message:
        "write the report"
    shell:
        "python {params.script:q} --results {params.results:q} --batch-size {params.batch_size}"
        " --settings {params.settings:q} --key {params.key} --output {output:q}"
        " --processes {threads} > {log:q} 2>&1"
