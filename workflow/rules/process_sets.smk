# Check the recordings and fit the nodules, with one job for a set of recordings in place of a job
# for each. The scripts make only what does not fit its record.
#
# takes: raw/<size>mm/<run>.csv, results/recordings.csv
# gives: the results of preprocess.smk and fit.smk, and the files that list those of a set with
#        their checksums, results/sets/<recordings per job>/{preprocess,fit}/<folder>/<set>.sha256


wildcard_constraints:
    set=r"[^/]+/[^/]+",


rule preprocess_set:
    input:
        script=script("preprocess_set.py"),
    output:
        f"results/sets/{PER_JOB}/preprocess/{{set}}.sha256",
    log:
        "results/logs/preprocess_set/{set}.log",
    conda:
        "../../environment.yml"
    params:
        raw=raw_folder,
        results=results_folder,
        recordings=recordings_of_set,
        settings=SET_SETTINGS["preprocess"],
        key=KEYS["preprocess"],
        made_from=made_from_set("preprocess"),
    shell:
        "python {input.script:q} {params.recordings:q} --raw {params.raw:q}"
        " --results {params.results:q} --settings {params.settings:q} --key {params.key}"
        " --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


rule fit_set:
    input:
        preprocessed=rules.preprocess_set.output,
        # With on_rejected: fail, the run stops before any fit; otherwise fits need not wait.
        index=ancient("results/recordings.csv") if config["on_rejected"] == "fail" else [],
        script=script("fit_set.py"),
    output:
        f"results/sets/{PER_JOB}/fit/{{set}}.sha256",
    log:
        "results/logs/fit_set/{set}.log",
    conda:
        "../../environment.yml"
    params:
        raw=raw_folder,
        results=results_folder,
        recordings=recordings_of_set,
        settings=SET_SETTINGS["fit"],
        key=KEYS["fit"],
        made_from=made_from_set("fit"),
    shell:
        "python {input.script:q} {params.recordings:q} --raw {params.raw:q}"
        " --results {params.results:q} --settings {params.settings:q} --key {params.key}"
        " --output {output:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"


if workflow.is_main_process:
    prepare_sets("preprocess", SETS)
    prepare_sets("fit", sets_of(ARCHIVE.of_nodules()))
