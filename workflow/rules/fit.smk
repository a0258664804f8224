# Fit a particle to each recording of a nodule, and average the fits of each size to a template.
#
# takes: results/matrices/<size>mm/<run>.npy, results/signals/<size>mm/<run>.npy,
#        results/recordings.csv
# gives: results/fits/<size>mm/<run>.json, results/templates.json, results/templates.npz


rule fit:
    input:
        matrix=rules.preprocess.output.matrix,
        signal=rules.preprocess.output.signal,
        # With on_rejected: fail, the run stops before any fit; otherwise fits need not wait.
        index=ancient(rules.index.output.recordings) if config["on_rejected"] == "fail" else [],
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


rule average:
    input:
        fits=expand(rules.fit.output, recording=ARCHIVE.of_nodules()),
        recordings=rules.index.output.recordings,
        script=script("average.py"),
    output:
        parameters="results/templates.json",
        matrices="results/templates.npz",
    log:
        "results/logs/average.log",
    conda:
        "../../environment.yml"
    params:
        results=results_folder,
        settings=as_parameter(TEMPLATE_SETTINGS),
        made_from=made_from(
            "average", as_parameter(TEMPLATE_SETTINGS), members=ARCHIVE.of_nodules()
        ),
    shell:
        "python {input.script:q} --recordings {input.recordings:q} --fits {params.results:q}/fits"
        " --settings {params.settings:q} --parameters {output.parameters:q}"
        " --matrices {output.matrices:q}"
        " --record {params.made_from:q} > {log:q} 2>&1"
