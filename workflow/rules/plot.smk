# Collect what the report draws of each recording of a folder, or of a part of a large one.
#
# takes: results/signals/, results/checks/; workflow/weights/scorer.npz
# gives: results/plot_data/<batch>.json

PLOT = step(
    "plot",
    sections("recording", "preprocessing", "diagonal"),
    lambda batch: map(PREPROCESS.key, PARTS[batch]),
    beside=[WEIGHTS],
)


rule plot:
    input:
        signals=each_part("signals"),
        checks=each_part("checks"),
    output:
        stored("plot_data"),
    log:
        "results/logs/plot/{batch}.log",
    conda:
        "../environment.yml"
    params:
        **told(PLOT),
        recordings=lambda wildcards: DESCRIBED[wildcards.batch],
    message:
        "plot {wildcards.batch}"
    shell:
        "python {params.script:q} {params.recordings:q} --signals {input.signals:q}"
        " --checks {input.checks:q} --settings {params.settings:q} --output {output:q}"
        " > {log:q} 2>&1"
