# List all recordings, and the other files under raw/.
#
# takes: results/checks/<size>mm/<run>.json; results/signals/<size>mm/<run>.npy, which the same jobs
#        make, of recordings that may be nearly the same
# gives: results/recordings.csv, results/passed_over.csv


rule index:
    input:
        checks=files_of("checks", ARCHIVE.recordings),
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
