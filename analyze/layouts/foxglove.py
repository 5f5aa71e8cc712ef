"""Writes a layout for Foxglove and Lichtblick that shows a derived.mcap.

    python analyze/layouts/foxglove.py FL FR RL RR > analyze/layouts/foxglove.json

The arguments are the wheels' names; the layout in the repository is for those of a machine with four.
"""

import json
import sys


def plot(title, paths, unit):
    return {
        "paths": [{"value": path, "label": label, "enabled": True, "timestampMethod": "headerStamp"}
                  for label, path in paths],
        "title": title, "yAxisLabel": unit, "showLegend": True, "legendDisplay": "floating",
        "isSynced": True, "xAxisVal": "timestamp", "showXAxisLabels": True, "showYAxisLabels": True,
        "sidebarDimension": 240,
    }


def layout(wheels):
    lower = [wheel.lower() for wheel in wheels]
    of_wheels = lambda topic, field: [(w, f"/tipwatch/{topic}.{field.format(w)}") for w in lower]
    panels = {
        "3D!machine": {
            "followMode": "follow-pose", "followTf": "base_link", "scene": {},
            "cameraState": {"distance": 9, "phi": 45, "thetaOffset": 60, "perspective": True,
                            "target": [0, 0, 0], "targetOffset": [0, 0, 0],
                            "targetOrientation": [0, 0, 0, 1], "fovy": 45, "near": 0.1, "far": 1000},
            "topics": {"/tipwatch/markers": {"visible": True}},
            "layers": {"grid": {"layerId": "foxglove.Grid", "visible": True, "size": 10, "divisions": 10,
                                "instanceId": "grid"}},
        },
        "Plot!loads": plot("Wheel loads", of_wheels("loads", "load_{}"), "N"),
        "Plot!margins": plot("OTF: negative where a wheel would have to pull", of_wheels("margins", "otf_{}"), "N"),
        "Plot!zmp": plot("Distance of the ZMP from the nearest edge", [("margin", "/tipwatch/margins.zmp_margin")], "m"),
        "DiagnosticSummary!diagnostics": {"minLevel": 0, "pinnedIds": [], "hardwareIdFilter": "",
                                          "topicToRender": "/diagnostics", "sortByLevel": True},
    }
    right = {"first": "Plot!loads", "direction": "column", "splitPercentage": 40,
             "second": {"first": "Plot!margins", "second": "Plot!zmp", "direction": "column"}}
    left = {"first": "3D!machine", "second": "DiagnosticSummary!diagnostics", "direction": "column",
            "splitPercentage": 70}
    return {
        "configById": panels, "globalVariables": {}, "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"first": left, "second": right, "direction": "row", "splitPercentage": 40},
    }


if __name__ == "__main__":
    json.dump(layout(sys.argv[1:]), sys.stdout, indent=1)
    print()
