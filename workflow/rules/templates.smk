# Average the fits of each size to a template.
#
# takes: results/fits/<size>mm/<run>.json, results/labelled.csv
# gives: results/templates.json, results/templates.npz

TEMPLATES = step(
    "templates",
    {
        "sensors": config["recording"]["sensors"],
        "first_peak": config["fit"]["first_peak"],
        "length": config["preprocessing"]["length"],
        "held_out": config["evaluation"]["held_out"],
    },
    lambda _: [LIST_LABELLED.key(), *map(FIT.key, NODULES)],
)


rule templates:
    input:
        fits=each("fit", NODULES),
        recordings=rules.list_labelled.output,
    output:
        parameters="results/templates.json",
        matrices="results/templates.npz",
    log:
        "results/logs/templates.log",
    conda:
        "../environment.yml"
    params:
        **told(TEMPLATES),
    message:
        "average the fits to templates"
    shell:
        "python {params.script:q} --recordings {input.recordings:q} --results {params.results:q}"
        " --settings {params.settings:q}"
        " --parameters {output.parameters:q} --matrices {output.matrices:q} > {log:q} 2>&1"
