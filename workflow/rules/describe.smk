# Describe the recordings of a folder, or of a part of a large one: the best candidate for a nodule,
# the network's features, and what the report draws of each.
#
# takes: results/signals/; results/checks/, which the same jobs make; workflow/weights/scorer.npz
# gives: results/best_places/<batch>.csv, results/features/<batch>.npz,
#        results/plot_data/<batch>.json

DESCRIBE = step(
    "describe",
    sections("recording", "preprocessing", "diagonal"),
    lambda batch: keys_of(PREPROCESS, batches(DESCRIBED[batch], SIZE, batch)),
    beside=[WEIGHTS],
)


rule describe:
    input:
        lambda wildcards: expand(
            rules.preprocess.output.signals,
            batch=batches(DESCRIBED[wildcards.batch], SIZE, wildcards.batch),
        ),
    output:
        best_places=f"results/{pattern('best_places', SIZE)}",
        features=f"results/{pattern('features', SIZE)}",
        plot_data=f"results/{pattern('plot_data', SIZE)}",
    log:
        "results/logs/describe/{batch}.log",
    conda:
        "../../environment.yml"
    params:
        **told(DESCRIBE),
        recordings=lambda wildcards: DESCRIBED[wildcards.batch],
    message:
        "describe {wildcards.batch}"
    shell:
        "python {params.script:q} {params.recordings:q} --results {params.results:q}"
        " --batch {wildcards.batch:q} --batch-size {params.batch_size}"
        " --settings {params.settings:q} --best-places {output.best_places:q}"
        " --features {output.features:q} --plot-data {output.plot_data:q} > {log:q} 2>&1"
