# Draw the figures, collect what the report draws of each recording, and write the report.
#
# takes: results/recordings.csv, results/passed_over.csv, results/signals/, results/matrices/,
#        results/checks/, results/fits/, results/features/<set>.stretches.npz,
#        results/templates.{json,npz}, results/evaluation/, results/detections.csv,
#        results/sites.csv, results/surveys/, workflow/report/, config/phantom.yaml,
#        config/parts.yaml
# gives: results/evidence/<set>.json, results/figures/<figure>{,_column}.svg,
#        results/figures/<figure>.csv, results/report.html, of a large archive with results/report/
#        beside it and results/page_files.json; on request (snakemake -c2 figures) the same figures
#        for print, results/print/<figure>{,_column}.pdf

from capsule.figures.registry import FIGURES, SOURCES
from capsule.page.beside import stands_beside
from edges.durations import RULES

NODULES = set(ARCHIVE.of_nodules())
FIGURES_OF = {
    source: [name for name, row in FIGURES.items() if row.drawn_from == source]
    for source in SOURCES
}
EVALUATION = [rules.evaluate.output.predictions, *rules.evaluate.output.rates]
# The design of the capsule is drawn from the tables that also describe its parts.
DESIGN_TABLES = [own_file(PROJECT / "config" / name) for name in ("phantom.yaml", "parts.yaml")]
# The files that the figures of each source show, so that each job starts as soon as it can.
SHOWN = {
    "templates": rules.average.output,
    "evaluation": EVALUATION,
    "comparison": [*EVALUATION, rules.evaluate.output.learning, *rules.judge.output],
    "design": DESIGN_TABLES,
}
# Figures of the evaluation also show the readings of two recordings. Those change only together
# with the evaluation. As inputs, they would be all recordings.
SHOWN_MEMBERS = {"evaluation": ARCHIVE.labelled()}
# Figures use only one key of the section `report`: the detector that is shown first.
SHOWN_SETTINGS = {
    "templates": {},
    "evaluation": {
        **{name: config[name] for name in ("recording", "preprocessing", "evaluation")},
        "report": {"lead": config["report"]["lead"]},
    },
    "comparison": {"evaluation": config["evaluation"]},
    "design": {"recording": {"sensors": config["recording"]["sensors"]}},
}
# The report prints a checksum of this code, which identifies the code behind its results. As
# inputs, Snakemake would read each of these files at the end of the report's job.
REGISTERED = [*DETECTOR_MODULES, *sorted({row.module for row in FIGURES.values()})]
CODE = sorted(
    {path for stage in [*RULES, "report"] for path in code_files(f"{stage}.py", *REGISTERED)}
)
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
BESIDE = stands_beside(len(ARCHIVE.recordings), config)
PAGE_FILES_SECTIONS = ["evaluation", "fit", "preprocessing", "recording"]


# The rules draw_templates, draw_evaluation, draw_comparison and draw_design draw for the report;
# print_templates and so on draw the same for print, on request.
for verb, folder, kind in [("draw", "figures", "svg"), ("print", "print", "pdf")]:
    for source in SOURCES:
        wide = expand(f"results/{folder}/{{figure}}.{kind}", figure=FIGURES_OF[source])

        rule:
            name:
                f"{verb}_{source}"
            input:
                shown=SHOWN[source],
                paper=report_file("paper.yaml"),
                script=script("draw.py"),
            output:
                report(wide, caption="../report/captions/figures.rst", category="Figures")
                if verb == "draw"
                else wide,
                expand(f"results/{folder}/{{figure}}_column.{kind}", figure=FIGURES_OF[source]),
                expand(f"results/{folder}/{{figure}}.csv", figure=FIGURES_OF[source]),
            log:
                f"results/logs/{verb}/{source}.log",
            conda:
                "../../environment.yml"
            params:
                results=results_folder,
                settings=as_parameter(SHOWN_SETTINGS[source]),
                made_from=made_from(
                    f"{verb}_{source}",
                    as_parameter(SHOWN_SETTINGS[source]),
                    script="draw.py",
                    modules=sorted({FIGURES[name].module for name in FIGURES_OF[source]}),
                    members=SHOWN_MEMBERS.get(source, []),
                ),
                figures=FIGURES_OF[source],
                kind=kind,
                folder=folder,
            shell:
                "python {input.script:q} --results {params.results:q} --paper {input.paper:q}"
                " --settings {params.settings:q} --figures {params.figures:q}"
                " --kind {params.kind} --output {params.results:q}/{params.folder}"
                " --record {params.made_from:q} > {log:q} 2>&1"


# One job takes a folder or a part of it, as the search does. The report adds what depends on all
# recordings: verdicts and templates.
rule evidence:
    input:
        signals=files_of("signals", recordings_of_search_set),
        checks=files_of("checks", recordings_of_search_set),
        fits=files_of(
            "fits",
            lambda wildcards: sorted(NODULES.intersection(recordings_of_search_set(wildcards))),
        ),
        stretches=rules.features.output.stretches if BY_FEATURES else [],
        script=script("evidence.py"),
    output:
        "results/evidence/{search_set}.json",
    log:
        "results/logs/evidence/{search_set}.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        recordings=recordings_of_search_set,
        rate_hz=config["recording"]["rate_hz"],
        settings=section("diagonal", "preprocessing"),
        made_from=made_from(
            "evidence",
            section("diagonal", "preprocessing"),
            as_parameter(config["recording"]["rate_hz"]),
            members=recordings_of_search_set,
        ),
    shell:
        "python {input.script:q} {params.recordings:q}"
        " --signals {params.results:q}/signals --checks {params.results:q}/checks"
        " --fits {params.results:q}/fits --stretches {input.stretches:q}"
        " --rate-hz {params.rate_hz} --settings {params.settings:q} --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


# Only for a large archive. It runs beside the judgement, which it does not show.
rule page_files:
    input:
        recordings=rules.index.output.recordings,
        predictions=rules.evaluate.output.predictions,
        detections=rules.detect.output.detections,
        # The matrices and the fits, which this job reads too, are made before these.
        evidence=expand(rules.evidence.output, search_set=SEARCH_SETS),
        script=script("page_files.py"),
    output:
        listed="results/page_files.json",
        folder=directory("results/report"),
    log:
        "results/logs/page_files.log",
    conda:
        "../../environment.yml"
    threads: BESIDE_ANOTHER
    params:
        results=results_folder,
        settings=section(*PAGE_FILES_SECTIONS),
        made_from=made_from("page_files", section(*PAGE_FILES_SECTIONS), members=ARCHIVE.recordings),
    shell:
        "python {input.script:q} --results {params.results:q} --evidence {input.evidence:q}"
        " --settings {params.settings:q} --output {output.listed:q} --folder {output.folder:q}"
        " --processes {threads}"
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
        figures=[getattr(rules, f"draw_{source}").output for source in SOURCES],
        surveys=expand(rules.chart_survey.output, survey=SURVEYS.names),
        # The matrices and the fits, which the report reads too, are made before these.
        evidence=[] if BESIDE else expand(rules.evidence.output, search_set=SEARCH_SETS),
        listed=rules.page_files.output.listed if BESIDE else [],
        beside=rules.page_files.output.folder if BESIDE else [],
        template=report_file("report.html.j2"),
        page=PAGE,
        schema=own_file(SCHEMA),
        script=script("report.py"),
    output:
        report(
            "results/report.html",
            caption="../report/captions/report.rst",
            category="Report",
        ),
    log:
        "results/logs/report.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        settings=section(*RESULT_SECTIONS),
        surveys=LISTED_SURVEYS,
        code=[os.path.relpath(path) for path in CODE],
        made_from=made_from(
            "report",
            section(*RESULT_SECTIONS),
            LISTED_SURVEYS,
            as_parameter(checksum_of_code(CODE)),
            modules=REGISTERED,
            members=ARCHIVE.recordings,
        ),
        template=lambda wildcards, input: os.path.dirname(input.template),
    shell:
        "python {input.script:q} --results {params.results:q} --evidence {input.evidence:q}"
        " --template {params.template:q}"
        " --schema {input.schema:q} --settings {params.settings:q} --surveys {params.surveys:q}"
        " --code {params.code:q} --output {output:q} --beside {input.listed:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
