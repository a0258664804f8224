# From the recordings in raw/ to one report: snakemake -c2 results/report.html


include: "workflow/Snakefile"


# Snakemake ignores the default target of an included file, so this file names its own.
rule everything:
    default_target: True
    input:
        rules.all.input,
