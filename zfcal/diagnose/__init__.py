"""Where a model and measured tracks disagree, and which effect is missing.

Works on scenes (`zfcal.model.scene`) and models; files are read and written in
`zfcal.stages.diagnose`, pictures are drawn in `zfcal.report`.
"""
