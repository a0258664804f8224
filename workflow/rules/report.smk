# What people look at: the figures, and one page with everything.
#
# takes: raw/, results/recordings.csv, results/passed_over.csv, results/fits/,
#        results/templates.{json,npz}, results/evaluation/, results/detections.csv, workflow/report/
# gives: results/figures/<figure>{,_column}.{svg,pdf}, results/figures/<figure>.csv,
#        results/report.html

FIGURES = [
    "preprocessing",
    "templates",
    "detection",
    "sizing",
    "negatives",
    "confusion",
    "roc",
]
TABLES = ["predictions", "detection", "specificity", "sizing", "confusion", *JUDGEMENTS]
# The report says by a checksum which code its results come from.
STAGES = [
    "preprocess",
    "index",
    "fit",
    "average",
    "passages",
    "evaluate",
    "judge",
    "detect",
    "combine",
    "draw",
    "report",
]
CODE = {script(f"{stage}.py") for stage in STAGES}
CODE.update(path for stage in STAGES for path in library(f"{stage}.py"))


rule draw:
    input:
        raw=expand("raw/{recording}.csv", recording=ARCHIVE.labelled()),
        evaluation=expand("results/evaluation/{table}.csv", table=TABLES),
        templates="results/templates.npz",
        parameters="results/templates.json",
        paper=report_file("paper.yaml"),
        script=script("draw.py"),
        library=library("draw.py"),
    output:
        expand(
            "results/figures/{figure}{width}.{kind}",
            figure=FIGURES,
            width=["", "_column"],
            kind=["svg", "pdf"],
        ),
        expand("results/figures/{figure}.csv", figure=FIGURES),
    log:
        "results/logs/draw.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("recording", "preprocessing", "evaluation"),
        code=content_of_code("draw.py"),
    shell:
        "python {input.script:q} --raw raw --evaluation results/evaluation"
        " --templates {input.templates:q} --parameters {input.parameters:q}"
        " --paper {input.paper:q} --settings {params.settings:q} --output results/figures"
        " > {log:q} 2>&1"


rule report:
    input:
        recordings="results/recordings.csv",
        passed_over="results/passed_over.csv",
        parameters="results/templates.json",
        evaluation=expand("results/evaluation/{table}.csv", table=TABLES),
        detections="results/detections.csv",
        sites="results/sites.csv",
        figures=rules.draw.output,
        raw=expand("raw/{recording}.csv", recording=ARCHIVE.recordings),
        fits=expand("results/fits/{recording}.json", recording=ARCHIVE.of_nodules()),
        page=[
            report_file(name)
            for name in [
                "report.html.j2",
                "report.css",
                "signals.js",
                "viewer.js",
                "recordings.js",
                "paper.yaml",
                "vendor/uplot/uPlot.iife.min.js",
                "vendor/uplot/uPlot.min.css",
            ]
        ],
        schema=os.path.relpath(SCHEMA),
        script=script("report.py"),
        code=sorted(CODE),
    output:
        "results/report.html",
    log:
        "results/logs/report.log",
    conda:
        "../../environment.yml"
    params:
        settings=section(*sorted(config)),
        code=content_of_code("report.py"),
        template=lambda wildcards, input: os.path.dirname(input.page[0]),
    shell:
        "python {input.script:q} --raw raw --results results --template {params.template:q}"
        " --schema {input.schema:q} --settings {params.settings:q}"
        " --code {input.code:q} --output {output:q} > {log:q} 2>&1"
