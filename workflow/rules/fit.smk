# Fit a particle to each recording of a nodule that teaches.
#
# takes: results/matrices/<size>mm/<run>.npy, results/signals/<size>mm/<run>.npy
# gives: results/fits/<size>mm/<run>.json

FIT = step("fit", sections("fit"), lambda batch: [PREPROCESS.key(batch), *NODULES[batch]])


rule fit:
    input:
        matrices=rules.preprocess.output.matrices,
        signals=rules.preprocess.output.signals,
    output:
        stored("fits"),
    log:
        "results/logs/fit/{batch}.log",
    conda:
        "../environment.yml"
    params:
        **told(FIT),
        recordings=lambda wildcards: NODULES[wildcards.batch],
    message:
        "fit {wildcards.batch}"
    shell:
        "python {params.script:q} {params.recordings:q} --batch {wildcards.batch:q}"
        " --signals {input.signals:q} --matrices {input.matrices:q} --settings {params.settings:q}"
        " --output {output:q} > {log:q} 2>&1"
