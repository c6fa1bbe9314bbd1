"""From a result to files people and programs read.

``document`` writes report.html, ``pdf`` report.pdf, ``tables`` the csv files, ``index`` index.html and summary.csv over
all specimens, ``frames`` a result as pandas frames for notebooks, ``paper`` the source paper's virtual experiments.

Each has `pipeline.result.Result` as its only source and measures nothing. A number is shown with its standard deviation
or said to be exact, in the unit and with the digits a reader wants (`pipeline.units`, `pipeline.rounding`). Texts of
report and index come from ``templates/words.toml``, sentences of other rooms from `pipeline.messages`.
"""
