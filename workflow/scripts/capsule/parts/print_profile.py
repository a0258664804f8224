"""Make the print profile for PrusaSlicer."""

from capsule.parts.design import Printing


def profile_text(printing: Printing) -> str:
    """Return a profile that prints a wall of up to twice the nozzle's width as one line.

    The generator Arachne makes a line as wide as its wall. The classic generator would print two
    lines, or leave a gap. Support is off, since no part needs it.
    """
    x, y, z = printing.bed_x_mm, printing.bed_y_mm, printing.bed_z_mm
    nozzle, layer = printing.nozzle_mm, printing.layer_mm
    values = {
        "bed_shape": f"0x0,{x:g}x0,{x:g}x{y:g},0x{y:g}",
        "max_print_height": f"{z:g}",
        "nozzle_diameter": f"{nozzle:g}",
        "filament_diameter": "1.75",
        "layer_height": f"{layer:g}",
        "first_layer_height": f"{layer:g}",
        "perimeter_generator": "arachne",
        "perimeters": "2",
        "extrusion_width": f"{1.125 * nozzle:g}",
        "external_perimeter_extrusion_width": f"{1.125 * nozzle:g}",
        "perimeter_extrusion_width": f"{1.125 * nozzle:g}",
        "first_layer_extrusion_width": f"{1.125 * nozzle:g}",
        "wall_transition_length": f"{nozzle:g}",
        "min_bead_width": "85%",
        "min_feature_size": "25%",
        "fill_density": "20%",
        "support_material": "0",
        "brim_width": "0",
        "skirts": "0",
        "elefant_foot_compensation": "0",
        "resolution": "0",
        "gcode_resolution": "0.0125",
        "gcode_comments": "0",
        "temperature": "230",
        "bed_temperature": "50",
        "max_print_speed": "30",
        "perimeter_speed": "20",
        "external_perimeter_speed": "15",
    }
    lines = [f"{name} = {value}" for name, value in values.items()]
    return "# PrusaSlicer: prusa-slicer --load print-profile.ini --export-gcode PART.stl\n" + (
        "\n".join(lines) + "\n"
    )
