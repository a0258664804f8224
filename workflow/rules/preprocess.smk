# Check each recording and compute its matrix. A batch is one recording, in a large archive several.
#
# takes: raw/<size>mm/<run>.csv
# gives: results/signals/<size>mm/<run>.npy, results/matrices/<size>mm/<run>.npy,
#        results/checks/<size>mm/<run>.json; of a batch of several, .npz and .json

BENCH_SETTINGS = {name: config["diagonal"][name] for name in BENCH}
PREPROCESS = step(
    "preprocess", sections("recording", "preprocessing", diagonal=BENCH_SETTINGS), contents_of
)


rule preprocess:
    output:
        signals=stored("signals"),
        matrices=stored("matrices"),
        checks=stored("checks"),
    log:
        "results/logs/preprocess/{batch}.log",
    # With on_rejected: fail, all recordings are checked before the fits begin.
    priority: 2 if config["on_rejected"] == "fail" else 0
    conda:
        "../environment.yml"
    params:
        **told(PREPROCESS),
        # The recordings are no inputs: their content decides, not their time stamps. The job
        # compares the checksums again.
        recordings=lambda wildcards: BATCHES[wildcards.batch],
        contents=lambda wildcards: contents_of(wildcards.batch),
    message:
        "preprocess {wildcards.batch}"
    shell:
        "python {params.script:q} {params.recordings:q} --contents {params.contents:q}"
        " --batch {wildcards.batch:q} --settings {params.settings:q} --signals {output.signals:q}"
        " --matrices {output.matrices:q} --checks {output.checks:q} > {log:q} 2>&1"
