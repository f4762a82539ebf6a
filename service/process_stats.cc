// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/process_stats.h"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

namespace ndmap::service {
namespace {

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

}  // namespace

v1::ProcessStats ReadProcessStats(absl::string_view program, absl::string_view address) {
  v1::ProcessStats stats;
  stats.set_program(std::string(program));
  stats.set_address(std::string(address));
  stats.set_pid(getpid());
  // Lines like "VmHWM:    1234 kB".
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);) {
    std::istringstream in(line);
    std::string name;
    uint64_t kilobytes = 0;
    in >> name >> kilobytes;
    if (name == "VmHWM:") stats.set_peak_rss_bytes(kilobytes * 1024);
    if (name == "VmRSS:") stats.set_rss_bytes(kilobytes * 1024);
  }
  rusage usage;
  if (getrusage(RUSAGE_SELF, &usage) == 0) {
    stats.set_user_seconds(Seconds(usage.ru_utime));
    stats.set_system_seconds(Seconds(usage.ru_stime));
  }
  return stats;
}

}  // namespace ndmap::service
