"""Where a model and measured tracks disagree, and which effect is missing.

Works on scenes (`zfcal.model.scene`) and models; files are read and written in
``online``, pictures are drawn in ``report``.
"""
