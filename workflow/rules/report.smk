# Draw the figures, and write the report.
#
# takes: results/recordings.csv, results/passed_over.csv, results/signals/, results/checks/,
#        results/fits/, results/features/<set>.stretches.npz, results/templates.{json,npz},
#        results/evaluation/, results/detections.csv, results/sites.csv, results/surveys/,
#        workflow/report/, config/phantom.yaml, config/parts.yaml
# gives: results/figures/<figure>{,_column}.svg, results/figures/<figure>.csv,
#        results/report.html, of a large archive with results/report/ beside it; on request
#        (snakemake -c2 figures) the same figures for print, results/print/<figure>{,_column}.pdf

from capsule.figures.registry import FIGURES
from capsule.page.beside import stands_beside
from edges.durations import RULES

DRAW_SETTINGS = {name: config[name] for name in ("recording", "preprocessing", "evaluation")}
# Figures use only one key of the section `report`: the detector that is shown first.
DRAW_SETTINGS["report"] = {"lead": config["report"]["lead"]}
DESIGN_SETTINGS = {"recording": {"sensors": config["recording"]["sensors"]}}
RESULT_FIGURES = [name for name, row in FIGURES.items() if not row.of_design]
DESIGN_FIGURES = [name for name, row in FIGURES.items() if row.of_design]
FIGURE_MODULES = sorted({row.module for row in FIGURES.values()})
# The figures of results are drawn from these files, and from the readings of two recordings. Those
# change only together with the evaluation. As inputs, each figure would list all recordings.
FIGURE_INPUTS = [
    rules.evaluate.output.predictions,
    *rules.evaluate.output.rates,
    rules.evaluate.output.learning,
    *rules.judge.output,
    *rules.average.output,
]
# The figures of the capsule's design are drawn from the tables that also describe its parts.
DESIGN_TABLES = [own_file(PROJECT / "config" / name) for name in ("phantom.yaml", "parts.yaml")]
# The report prints a checksum of this code, which identifies the code behind its results.
REGISTERED = [*DETECTOR_MODULES, *FIGURE_MODULES]
CODE = {path for stage in [*RULES, "report"] for path in code_files(f"{stage}.py", *REGISTERED)}
# The page is made from these templates, and shows the paper's numbers from these tables.
PAGE = sorted(
    own_file(path)
    for pattern in [
        "report.css",
        "macros.html.j2",
        "sections/[!.]*.html.j2",
        "scripts/[!.]*.js",
        "vendor/uplot/uPlot*",
        "paper.yaml",
        "benches.csv",
        "references.bib",
    ]
    for path in Path(report_file("")).glob(pattern)
)
LISTED_SURVEYS = as_parameter({"names": SURVEYS.names, "passed_over": SURVEYS.passed_over})
# For a large archive, the data that the page draws are in a folder beside the page.
BESIDE = "report" if stands_beside(len(ARCHIVE.recordings), config) else ""


rule draw:
    input:
        shown=FIGURE_INPUTS,
        paper=report_file("paper.yaml"),
        script=script("draw.py"),
    output:
        report(
            expand("results/figures/{figure}.svg", figure=RESULT_FIGURES),
            caption="../report/captions/figures.rst",
            category="Figures",
        ),
        expand("results/figures/{figure}_column.svg", figure=RESULT_FIGURES),
        expand("results/figures/{figure}.csv", figure=RESULT_FIGURES),
    log:
        "results/logs/draw.log",
    conda:
        "../../environment.yml"
    threads: 2
    params:
        results=results_folder,
        settings=as_parameter(DRAW_SETTINGS),
        made_from=made_from(
            "draw",
            as_parameter(DRAW_SETTINGS),
            modules=sorted({FIGURES[name].module for name in RESULT_FIGURES}),
            members=ARCHIVE.labelled(),
        ),
        figures=RESULT_FIGURES,
    shell:
        "python {input.script:q} --results {params.results:q} --paper {input.paper:q}"
        " --settings {params.settings:q} --figures {params.figures:q} --kind svg"
        " --output {params.results:q}/figures --processes {threads}"
        " --record {params.made_from:q} > {log:q} 2>&1"


# These figures show no recording, so a new recording does not draw them again.
rule draw_design:
    input:
        design=DESIGN_TABLES,
        script=script("draw_design.py"),
    output:
        report(
            expand("results/figures/{figure}.svg", figure=DESIGN_FIGURES),
            caption="../report/captions/figures.rst",
            category="Figures",
        ),
        expand("results/figures/{figure}_column.svg", figure=DESIGN_FIGURES),
        expand("results/figures/{figure}.csv", figure=DESIGN_FIGURES),
    log:
        "results/logs/draw_design.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        settings=as_parameter(DESIGN_SETTINGS),
        made_from=made_from(
            "draw_design",
            as_parameter(DESIGN_SETTINGS),
            modules=sorted({FIGURES[name].module for name in DESIGN_FIGURES}),
        ),
        figures=DESIGN_FIGURES,
    shell:
        "python {input.script:q} --settings {params.settings:q} --figures {params.figures:q}"
        " --output {params.results:q}/figures"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule print_figures:
    input:
        shown=FIGURE_INPUTS,
        paper=report_file("paper.yaml"),
        design=DESIGN_TABLES,
        script=script("draw.py"),
    output:
        expand("results/print/{figure}{width}.pdf", figure=FIGURES, width=["", "_column"]),
        expand("results/print/{figure}.csv", figure=FIGURES),
    log:
        "results/logs/print_figures.log",
    conda:
        "../../environment.yml"
    threads: 2
    params:
        results=results_folder,
        settings=as_parameter(DRAW_SETTINGS),
        made_from=made_from(
            "print_figures",
            as_parameter(DRAW_SETTINGS),
            script="draw.py",
            modules=FIGURE_MODULES,
            members=ARCHIVE.labelled(),
        ),
        figures=list(FIGURES),
    shell:
        "python {input.script:q} --results {params.results:q} --paper {input.paper:q}"
        " --settings {params.settings:q} --figures {params.figures:q} --kind pdf"
        " --output {params.results:q}/print --processes {threads}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule report:
    input:
        recordings=rules.index.output.recordings,
        passed_over=rules.index.output.passed_over,
        parameters=rules.average.output.parameters,
        evaluation=[rules.evaluate.output.predictions, *rules.evaluate.output.rates],
        judgements=rules.judge.output,
        learning=rules.evaluate.output.learning,
        detections=rules.detect.output.detections,
        sites=rules.combine.output,
        figures=[*rules.draw.output, *rules.draw_design.output],
        surveys=expand(rules.chart_survey.output, survey=SURVEYS.names),
        signals=files_of("signals", ARCHIVE.recordings),
        checks=files_of("checks", ARCHIVE.recordings),
        fits=files_of("fits", ARCHIVE.of_nodules()),
        stretches=(
            expand(rules.features.output.stretches, search_set=SEARCH_SETS) if BY_FEATURES else []
        ),
        template=report_file("report.html.j2"),
        page=PAGE,
        schema=own_file(SCHEMA),
        script=script("report.py"),
        code=sorted(map(own_file, CODE)),
    output:
        page=report(
            "results/report.html",
            caption="../report/captions/report.rst",
            category="Report",
        ),
        beside=directory(f"results/{BESIDE}") if BESIDE else [],
    log:
        "results/logs/report.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        settings=section(*RESULT_SECTIONS),
        surveys=LISTED_SURVEYS,
        made_from=made_from(
            "report",
            section(*RESULT_SECTIONS),
            LISTED_SURVEYS,
            modules=REGISTERED,
            members=ARCHIVE.recordings,
        ),
        template=lambda wildcards, input: os.path.dirname(input.template),
        beside=f"--beside {shlex.quote(RESULTS)}/{BESIDE}" if BESIDE else "",
    shell:
        "python {input.script:q} --results {params.results:q} --stretches {input.stretches:q}"
        " --template {params.template:q}"
        " --schema {input.schema:q} --settings {params.settings:q} --surveys {params.surveys:q}"
        " --code {input.code:q} --output {output.page:q} {params.beside}"
        " --record {params.made_from:q} > {log:q} 2>&1"
