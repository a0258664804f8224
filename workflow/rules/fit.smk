# Fit a particle to each recording of a nodule.
#
# takes: results/matrices/<size>mm/<run>.npy, results/signals/<size>mm/<run>.npy,
#        results/recordings.csv
# gives: results/fits/<size>mm/<run>.json


rule fit:
    input:
        matrix=rules.preprocess.output.matrix,
        signal=rules.preprocess.output.signal,
        # With on_rejected: fail, the run stops before any fit; otherwise fits need not wait.
        index=ancient("results/recordings.csv") if config["on_rejected"] == "fail" else [],
        script=script("fit.py"),
    output:
        "results/fits/{recording}.json",
    log:
        "results/logs/fit/{recording}.log",
    conda:
        "../../environment.yml"
    params:
        settings=section("fit"),
        made_from=made_from("fit", section("fit")),
    shell:
        "python {input.script:q} {input.matrix:q} --signal {input.signal:q}"
        " --name {wildcards.recording:q} --settings {params.settings:q} --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
