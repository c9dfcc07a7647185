"""Trains Homing's keypoint extractor and attention matcher, measures them and exports them to ONNX."""
