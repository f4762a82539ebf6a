# SPDX-License-Identifier: Apache-2.0
"""The generated messages and stubs of proto/ndmap/v1: `from ndmap.v1 import coordinator_pb2`, and so on."""
