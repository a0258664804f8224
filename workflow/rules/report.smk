# What people look at: the figures, and one page with everything.
#
# takes: results/recordings.csv, results/passed_over.csv, results/signals/, results/checks/,
#        results/fits/, results/templates.{json,npz}, results/evaluation/, results/detections.csv,
#        results/sites.csv, workflow/report/
# gives: results/figures/<figure>{,_column}.{svg,pdf}, results/figures/<figure>.csv,
#        results/report.html

from capsule.figures.registry import FIGURES
from edges.durations import RULES

# What each figure shows: it is drawn while the other results are still computed.
FIGURE_INPUTS = {
    row.name: [
        *expand("results/evaluation/{table}.csv", table=row.tables),
        *(rules.average.output if row.templates else []),
        *expand(
            rules.preprocess.output.signal, recording=ARCHIVE.labelled() if row.signals else []
        ),
    ]
    for row in FIGURES.values()
}
# The report says by a checksum which code its results come from.
REGISTERED = [*DETECTOR_MODULES, *(row.module for row in FIGURES.values())]
CODE = {path for stage in [*RULES, "report"] for path in code_files(f"{stage}.py", *REGISTERED)}
# What the report is filled into, with the paper's numbers.
PAGE = sorted(
    path.as_posix()
    for pattern in [
        "report.css",
        "macros.html.j2",
        "sections/[!.]*.html.j2",
        "scripts/[!.]*.js",
        "vendor/uplot/uPlot*",
        "paper.yaml",
    ]
    for path in Path(report_file("")).glob(pattern)
)


rule draw:
    input:
        shown=lambda wildcards: FIGURE_INPUTS[wildcards.figure],
        paper=report_file("paper.yaml"),
        script=script("draw.py"),
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
        code=lambda wildcards: content_of_code("draw.py", FIGURES[wildcards.figure].module),
    shell:
        "python {input.script:q} --figure {wildcards.figure} --results results"
        " --paper {input.paper:q} --settings {params.settings:q} --output results/figures"
        " > {log:q} 2>&1"


rule report:
    input:
        recordings=rules.index.output.recordings,
        passed_over=rules.index.output.passed_over,
        parameters=rules.average.output.parameters,
        evaluation=[rules.evaluate.output.predictions, *rules.evaluate.output.rates],
        judgements=rules.judge.output,
        detections=rules.detect.output.detections,
        sites=rules.combine.output,
        figures=expand(rules.draw.output, figure=FIGURES),
        signals=expand(rules.preprocess.output.signal, recording=ARCHIVE.recordings),
        checks=expand(rules.preprocess.output.check, recording=ARCHIVE.recordings),
        fits=expand(rules.fit.output, recording=ARCHIVE.of_nodules()),
        template=report_file("report.html.j2"),
        page=PAGE,
        schema=os.path.relpath(SCHEMA),
        script=script("report.py"),
        code=sorted(map(os.path.relpath, CODE)),
    output:
        "results/report.html",
    log:
        "results/logs/report.log",
    conda:
        "../../environment.yml"
    params:
        settings=section(*sorted(config)),
        code=content_of_code("report.py"),
        template=lambda wildcards, input: os.path.dirname(input.template),
    shell:
        "python {input.script:q} --results results --template {params.template:q}"
        " --schema {input.schema:q} --settings {params.settings:q}"
        " --code {input.code:q} --output {output:q} > {log:q} 2>&1"
