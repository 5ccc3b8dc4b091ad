"""Bags of ROS 1 and ROS 2 and MCAP files with Foxglove's schemas, without ROS: `pip install spartan[bags]`.
Recordings of Rerun: `pip install spartan[rerun]`.

    from spartan import bags

    bags.import_bag("drive.bag", "recording")     # then spartan.run("recording", "run")
    bags.export_recording("kitti_06", "kitti_06.bag")
"""

from spartan.bags._export_recording import export_recording as export_recording
from spartan.bags._export_run import export_run as export_run
from spartan.bags._export_rerun import export_rerun as export_rerun
from spartan.bags._import import import_bag as import_bag
from spartan.bags._messages import world_covariance as world_covariance
from spartan.bags._writer import BagWriter as BagWriter
