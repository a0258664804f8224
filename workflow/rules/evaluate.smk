# Judge each labelled recording by detectors that it did not teach, and rate the detectors.
#
# takes: results/labelled.csv, results/matrices/, results/fits/, results/best_places/, results/features/
# gives: under results/evaluation/ predictions.csv, learning.csv and the tables of
#        capsule.evaluation.columns

from capsule.evaluation.columns import COLUMNS as RATES

EVALUATE = step(
    "evaluate",
    sections("detectors", "evaluation", "fit", "preprocessing", "recording", *DETECTOR_SECTIONS),
    lambda _: [
        LIST_LABELLED.key(),
        *map(FIT.key, NODULES),
        *map(DESCRIBE.key, DESCRIBED_LABELLED),
    ],
    modules=DETECTOR_MODULES,
)


rule evaluate:
    input:
        best_places=each("describe", DESCRIBED_LABELLED, "best_places"),
        features=each("describe", DESCRIBED_LABELLED, "features"),
        matrices=each("preprocess", LABELLED, "matrices"),
        # Each fold averages the fits anew.
        fits=each("fit", NODULES),
        recordings=rules.list_labelled.output,
    output:
        shown(expand("results/evaluation/{table}.csv", table=RATES), "rates", "Rates"),
        predictions="results/evaluation/predictions.csv",
        learning="results/evaluation/learning.csv",
    log:
        "results/logs/evaluate.log",
    conda:
        "../environment.yml"
    params:
        **told(EVALUATE),
    message:
        "evaluate the detectors on the labelled recordings"
    shell:
        "python {params.script:q} --recordings {input.recordings:q} --results {params.results:q}"
        " --settings {params.settings:q}"
        " --output {params.results:q}/evaluation > {log:q} 2>&1"
