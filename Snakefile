# From the recordings in raw/ to one report: snakemake -c2 results/report.html


include: "workflow/Snakefile"


# The default target of an included file does not count.
rule everything:
    default_target: True
    input:
        rules.all.input,
