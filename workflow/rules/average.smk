# Average the fits of each size to a template.
#
# takes: results/fits/<size>mm/<run>.json, results/recordings.csv
# gives: results/templates.json, results/templates.npz


rule average:
    input:
        fits=files_of("fits", ARCHIVE.of_nodules()),
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
