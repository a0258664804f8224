# Check each recording and compute its matrix, then list all recordings.
#
# takes: raw/<size>mm/<run>.csv
# gives: results/signals/<size>mm/<run>.npy, results/matrices/<size>mm/<run>.npy,
#        results/checks/<size>mm/<run>.json, results/recordings.csv, results/passed_over.csv


CHECK_SETTINGS = {name: config[name] for name in ("recording", "preprocessing")}
CHECK_SETTINGS["diagonal"] = {name: config["diagonal"][name] for name in BENCH}


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


rule index:
    input:
        checks=expand(rules.preprocess.output.check, recording=ARCHIVE.recordings),
        # The job compares the readings to find recordings that are nearly the same.
        signals=expand(rules.preprocess.output.signal, recording=ARCHIVE.recordings),
        script=script("index.py"),
    output:
        recordings=report(
            "results/recordings.csv",
            caption="../report/captions/recordings.rst",
            category="Recordings",
        ),
        passed_over="results/passed_over.csv",
    log:
        "results/logs/index.log",
    conda:
        "../../environment.yml"
    params:
        raw=raw_folder,
        results=results_folder,
        on_rejected=config["on_rejected"],
        # The table also lists files that are not recordings, so it changes with them.
        made_from=made_from(
            "index",
            as_parameter([config["on_rejected"], ARCHIVE.refused, ARCHIVE.passed_over]),
            members=ARCHIVE.recordings,
        ),
    shell:
        "python {input.script:q} --raw {params.raw:q} --checks {params.results:q}/checks"
        " --signals {params.results:q}/signals"
        " --on-rejected {params.on_rejected} --output {output.recordings:q}"
        " --passed-over {output.passed_over:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
