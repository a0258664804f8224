# List all recordings, and the other files under raw/. The labelled recordings have a list of their
# own, so that an unlabelled one makes neither templates nor the evaluation again.
#
# takes: results/checks/, results/signals/ of recordings that may be nearly the same; the names in raw/
# gives: results/recordings.csv, results/passed_over.csv, results/labelled.csv

ALL = sections("on_rejected", described=PARTS, others=ARCHIVE.others())
LIST = step("list", ALL, lambda _: map(PREPROCESS.key, BATCHES))
KNOWN_PARTS = {batch: PARTS[batch] for batch in DESCRIBED_LABELLED}
KNOWN = sections("on_rejected", described=KNOWN_PARTS, others="")
LIST_LABELLED = step("list", KNOWN, lambda _: map(PREPROCESS.key, LABELLED))


rule list:
    input:
        checks=each("preprocess", BATCHES, "checks"),
        signals=each("preprocess", BATCHES, "signals"),
    output:
        shown("results/recordings.csv", "recordings", "Recordings"),
        "results/passed_over.csv",
    log:
        "results/logs/list.log",
    priority: 1 if config["on_rejected"] == "fail" else 0
    conda:
        "../environment.yml"
    params:
        **told(LIST),
    message:
        "list the recordings"
    shell:
        "python {params.script:q} --raw {params.raw:q} --results {params.results:q}"
        " --settings {params.settings:q} --output {output:q} > {log:q} 2>&1"


use rule list as list_labelled with:
    input:
        checks=each("preprocess", LABELLED, "checks"),
        signals=each("preprocess", LABELLED, "signals"),
    output:
        "results/labelled.csv",
    log:
        "results/logs/list_labelled.log",
    params:
        **told(LIST_LABELLED),
    message:
        "list the labelled recordings"
