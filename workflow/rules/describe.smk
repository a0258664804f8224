# Describe the recordings of a folder, or of a part of a large one: the best candidate for a nodule,
# the traits of the wave and the network's features.
#
# takes: results/signals/; workflow/weights/scorer.npz
# gives: results/best_places/<batch>.csv, results/features/<batch>.npz

DESCRIBE = step(
    "describe",
    sections("recording", "diagonal"),
    lambda batch: map(PREPROCESS.key, PARTS[batch]),
    beside=[WEIGHTS],
)


rule describe:
    input:
        each_part("signals"),
    output:
        best_places=stored("best_places"),
        features=stored("features"),
    log:
        "results/logs/describe/{batch}.log",
    conda:
        "../environment.yml"
    params:
        **told(DESCRIBE),
        recordings=lambda wildcards: DESCRIBED[wildcards.batch],
    message:
        "describe {wildcards.batch}"
    shell:
        "python {params.script:q} {params.recordings:q} --signals {input:q}"
        " --settings {params.settings:q} --best-places {output.best_places:q}"
        " --features {output.features:q} > {log:q} 2>&1"
