"""Estimate the friction of a floor and the parameters of a chain, with uncertainties, from videos of walks.

Imported by users as `from warpchain import video`; the rest of the package does not need it.

    clip = video.read("clip.csv", links=60, frequency=20.0)
    print(video.friction_line(clip))
    training = video.TrainingSet.of(warpchain.sweep("training.yaml", "training"))
    print(training.posterior([clip]))
"""

from warpchain.video.camera import Camera as Camera
from warpchain.video.camera import Video as Video
from warpchain.video.camera import video_of as video_of
from warpchain.video.sliding import FrictionLine as FrictionLine
from warpchain.video.sliding import friction_line as friction_line
from warpchain.video.text_table import read as read
from warpchain.video.training_set import Posterior as Posterior
from warpchain.video.training_set import TrainingSet as TrainingSet
