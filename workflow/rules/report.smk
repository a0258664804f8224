# What people look at: the figures, and one page with everything.
#
# takes: results/recordings.csv, results/passed_over.csv, results/signals/, results/checks/,
#        results/fits/, results/templates.{json,npz}, results/evaluation/, results/detections.csv,
#        results/sites.csv, workflow/report/
# gives: results/figures/<figure>{,_column}.{svg,pdf}, results/figures/<figure>.csv,
#        results/report.html

RATES = expand(
    "results/evaluation/{table}.csv",
    table=["predictions", "detection", "specificity", "sizing", "confusion"],
)
JUDGED = expand("results/evaluation/{table}.csv", table=JUDGEMENTS)
# What each figure shows; most are drawn while the judgements are still computed.
FIGURES = {
    "preprocessing": [
        *RATES,
        *expand("results/signals/{recording}.npy", recording=ARCHIVE.labelled()),
    ],
    "templates": ["results/templates.npz", "results/templates.json"],
    "detection": RATES,
    "sizing": RATES,
    "negatives": RATES,
    "confusion": RATES,
    "roc": [*RATES, *JUDGED],
}
# The report says by a checksum which code its results come from.
STAGES = [*RULES, "report"]
CODE = {script(f"{stage}.py") for stage in STAGES}
CODE.update(path for stage in STAGES for path in library(f"{stage}.py"))


rule draw:
    input:
        shown=lambda wildcards: FIGURES[wildcards.figure],
        paper=report_file("paper.yaml"),
        script=script("draw.py"),
        library=library("draw.py"),
    output:
        expand(
            "results/figures/{{figure}}{width}.{kind}",
            width=["", "_column"],
            kind=["svg", "pdf"],
        ),
        "results/figures/{figure}.csv",
    log:
        "results/logs/draw/{figure}.log",
    wildcard_constraints:
        figure="|".join(FIGURES),
    conda:
        "../../environment.yml"
    params:
        settings=section("recording", "preprocessing", "evaluation"),
        code=content_of_code("draw.py"),
    shell:
        "python {input.script:q} --figure {wildcards.figure} --results results"
        " --paper {input.paper:q} --settings {params.settings:q} --output results/figures"
        " > {log:q} 2>&1"


rule report:
    input:
        recordings="results/recordings.csv",
        passed_over="results/passed_over.csv",
        parameters="results/templates.json",
        evaluation=[*RATES, *JUDGED],
        detections="results/detections.csv",
        sites="results/sites.csv",
        figures=expand(rules.draw.output, figure=FIGURES),
        signals=expand("results/signals/{recording}.npy", recording=ARCHIVE.recordings),
        checks=expand("results/checks/{recording}.json", recording=ARCHIVE.recordings),
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
        "python {input.script:q} --results results --template {params.template:q}"
        " --schema {input.schema:q} --settings {params.settings:q}"
        " --code {input.code:q} --output {output:q} > {log:q} 2>&1"
