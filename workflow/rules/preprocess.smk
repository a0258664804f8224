# Check each recording and compute its matrix.
#
# takes: raw/<size>mm/<run>.csv
# gives: results/signals/<size>mm/<run>.npy, results/matrices/<size>mm/<run>.npy,
#        results/checks/<size>mm/<run>.json


rule preprocess:
    input:
        script=script("preprocess.py"),
    output:
        signal="results/signals/{recording}.npy",
        matrix="results/matrices/{recording}.npy",
        check="results/checks/{recording}.json",
    log:
        "results/logs/preprocess/{recording}.log",
    conda:
        "../../environment.yml"
    params:
        settings=as_parameter(CHECK_SETTINGS),
        # The recording is no input: its content decides whether the job runs again, not its time
        # stamp, which may be in the future.
        recording=lambda wildcards: f"{RAW}/{wildcards.recording}.csv",
        content=content_of_recording,
        made_from=made_from("preprocess", as_parameter(CHECK_SETTINGS)),
    shell:
        "python {input.script:q} {params.recording:q} --name {wildcards.recording:q}"
        " --settings {params.settings:q} --signal {output.signal:q} --matrix {output.matrix:q}"
        " --check {output.check:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
