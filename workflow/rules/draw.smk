# Draw the paper's figures and ours: for the report, and on request for print.
#
# takes: results/labelled.csv, results/templates.{json,npz}, results/evaluation/, results/signals/ (two);
#        workflow/report/paper.yaml
# gives: results/figures/<figure>.{svg,csv}; on request (snakemake -c2 figures)
#        results/print/<figure>{,_column}.pdf, results/print/<figure>.csv

from capsule.figures.registry import FIGURES

DRAW = step(
    "draw",
    sections("recording", "preprocessing", "evaluation", report={"lead": config["report"]["lead"]}),
    lambda _: [TEMPLATES.key(), EVALUATE.key()],
    modules=sorted({*FIGURES.values()}),
    beside=[REPORT_FILES / "paper.yaml"],
)


rule draw:
    input:
        tables=rules.evaluate.output,
        templates=rules.templates.output,
        recordings=rules.list_labelled.output,
        signals=each("preprocess", LABELLED, "signals"),
    output:
        shown(expand("results/figures/{figure}.svg", figure=FIGURES), "figures", "Figures"),
        expand("results/figures/{figure}.csv", figure=FIGURES),
    log:
        "results/logs/draw.log",
    conda:
        "../environment.yml"
    params:
        **told(DRAW),
        kind="svg",
        folder="figures",
    message:
        "draw the figures"
    shell:
        "python {params.script:q} --recordings {input.recordings:q} --results {params.results:q}"
        " --settings {params.settings:q} --kind {params.kind}"
        " --output {params.results:q}/{params.folder} > {log:q} 2>&1"


use rule draw as figures with:
    output:
        expand("results/print/{figure}{width}.pdf", figure=FIGURES, width=["", "_column"]),
        expand("results/print/{figure}.csv", figure=FIGURES),
    log:
        "results/logs/figures.log",
    params:
        **told(DRAW),
        kind="pdf",
        folder="print",
    message:
        "draw the figures for print"
