# Evaluate the detectors: compare their verdicts on labelled recordings with the labels.
#
# takes: results/matrices/, results/fits/, results/passages/, results/recordings.csv,
#        results/detections.csv
# gives: results/sites.csv, and under results/evaluation/
#        {predictions,group_predictions,detection,specificity,sizing,confusion,learning}.csv and
#        the tables of capsule.evaluation.columns

from capsule.evaluation.columns import COLUMNS as JUDGEMENTS

RATES = ["detection", "specificity", "sizing", "confusion"]
EVALUATE_SECTIONS = ["detectors", "evaluation", "recording", *DETECTOR_SECTIONS]
LABELLED = set(ARCHIVE.labelled())
# With fewer recordings, a second process gains less than the drawing of figures beside.
TWO_PROCESSES_FROM = 500
LABELLED_SETS = [label for label, names in SEARCH_SETS.items() if LABELLED.intersection(names)]


rule evaluate:
    input:
        matrices=files_of("matrices", ARCHIVE.labelled()),
        fits=files_of("fits", ARCHIVE.of_nodules()),
        passages=expand(rules.passages.output, search_set=LABELLED_SETS),
        features=(
            expand(rules.features.output.features, search_set=LABELLED_SETS) if BY_FEATURES else []
        ),
        recordings=rules.index.output.recordings,
        script=script("evaluate.py"),
    output:
        rates=report(
            expand("results/evaluation/{table}.csv", table=RATES),
            caption="../report/captions/rates.rst",
            category="Rates",
        ),
        predictions="results/evaluation/predictions.csv",
        grouped="results/evaluation/group_predictions.csv",
        learning="results/evaluation/learning.csv",
    log:
        "results/logs/evaluate.log",
    conda:
        "../../environment.yml"
    threads: 2 if len(LABELLED) >= TWO_PROCESSES_FROM else 1
    params:
        results=results_folder,
        settings=section(*EVALUATE_SECTIONS),
        template_settings=as_parameter(TEMPLATE_SETTINGS),
        made_from=made_from(
            "evaluate",
            section(*EVALUATE_SECTIONS),
            as_parameter(TEMPLATE_SETTINGS),
            modules=DETECTOR_MODULES,
            members=ARCHIVE.labelled(),
        ),
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --matrices {params.results:q}/matrices --fits {params.results:q}/fits"
        " --passages {input.passages:q} --features {input.features:q}"
        " --settings {params.settings:q}"
        " --template-settings {params.template_settings:q} --output {params.results:q}/evaluation"
        " --processes {threads}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule judge:
    input:
        predictions=rules.evaluate.output.predictions,
        grouped=rules.evaluate.output.grouped,
        recordings=rules.index.output.recordings,
        script=script("judge.py"),
    output:
        report(
            expand("results/evaluation/{table}.csv", table=JUDGEMENTS),
            caption="../report/captions/rates.rst",
            category="Rates",
        ),
    log:
        "results/logs/judge.log",
    conda:
        "../../environment.yml"
    threads: BESIDE_ANOTHER if len(LABELLED) >= TWO_PROCESSES_FROM else 1
    params:
        results=results_folder,
        settings=section("evaluation"),
        made_from=made_from("judge", section("evaluation")),
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --predictions {input.predictions:q} {input.grouped:q} --settings {params.settings:q}"
        " --output {params.results:q}/evaluation --processes {threads}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule combine:
    input:
        predictions=rules.evaluate.output.predictions,
        grouped=rules.evaluate.output.grouped,
        detections=rules.detect.output.detections,
        recordings=rules.index.output.recordings,
        script=script("combine.py"),
    output:
        report(
            "results/sites.csv",
            caption="../report/captions/verdicts.rst",
            category="Verdicts",
        ),
    log:
        "results/logs/combine.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        settings=section("evaluation"),
        made_from=made_from("combine", section("evaluation")),
    shell:
        "python {input.script:q} --recordings {input.recordings:q}"
        " --evaluation {params.results:q}/evaluation --detections {input.detections:q}"
        " --settings {params.settings:q} --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
