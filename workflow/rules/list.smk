# List all recordings, and the other files under raw/. The labelled recordings have a list of their
# own, so that an unlabelled one makes neither templates nor the evaluation again.
#
# takes: results/checks/; results/signals/, which the same jobs make, of recordings that may be nearly
#        the same
# gives: results/recordings.csv, results/passed_over.csv, results/labelled.csv

OTHERS = {"refused": ARCHIVE.refused, "passed_over": ARCHIVE.passed_over}
LIST = step("list", sections("on_rejected", **OTHERS), lambda _: keys_of(PREPROCESS, BATCHES))
LIST_LABELLED = step("list", sections("on_rejected"), lambda _: keys_of(PREPROCESS, LABELLED))


rule list:
    input:
        each("preprocess", BATCHES, "checks"),
    output:
        shown("results/recordings.csv", "recordings", "Recordings"),
        "results/passed_over.csv",
    log:
        "results/logs/list.log",
    priority: 1 if config["on_rejected"] == "fail" else 0
    conda:
        "../../environment.yml"
    params:
        **told(LIST),
        which="all",
        on_rejected=config["on_rejected"],
    message:
        "list the recordings"
    shell:
        "python {params.script:q} --raw {params.raw:q} --results {params.results:q}"
        " --batch-size {params.batch_size} --which {params.which}"
        " --on-rejected {params.on_rejected} --output {output:q} > {log:q} 2>&1"


use rule list as list_labelled with:
    input:
        each("preprocess", LABELLED, "checks"),
    output:
        "results/labelled.csv",
    log:
        "results/logs/list_labelled.log",
    params:
        **told(LIST_LABELLED),
        which="labelled",
        on_rejected=config["on_rejected"],
    message:
        "list the labelled recordings"
