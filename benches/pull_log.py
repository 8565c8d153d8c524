"""Brings a file by pymavlink's MAVFTP: ADDRESS SYSTEM REMOTE LOCAL. Prints the seconds it took."""

import sys
import time

from pymavlink import mavftp, mavutil

address, system, remote, local = sys.argv[1:5]
link = mavutil.mavlink_connection(address, source_system=250)
link.wait_heartbeat(timeout=20)
begun = time.time()
ftp = mavftp.MAVFTP(link, target_system=int(system), target_component=1)
ftp.cmd_get([remote, local])
answer = ftp.process_ftp_reply("OpenFileRO", timeout=600)
print(f"{time.time() - begun:.2f} {answer.error_code}")
