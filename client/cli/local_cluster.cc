// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/local_cluster.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/cli/output_folder.h"

namespace ndmap::cli {
namespace {

constexpr const char* kLoopback = "127.0.0.1";

// One sentence if nobody can listen on the port; another program may still be faster than the coordinator.
absl::Status CheckPortIsFree(uint16_t port) {
  const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return absl::OkStatus();
  const int yes = 1;
  setsockopt(probe, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool bound = bind(probe, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  const int error = errno;
  close(probe);
  if (bound) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("port ", port, " on ", kLoopback, " cannot be used: ", std::strerror(error)));
}

// The last line that is not empty.
std::string LastLine(int log) {
  const off_t size = lseek(log, 0, SEEK_END);
  std::string text(static_cast<size_t>(std::min<off_t>(std::max<off_t>(size, 0), 4096)), '\0');
  const ssize_t got = pread(log, text.data(), text.size(), size - static_cast<off_t>(text.size()));
  text.resize(got > 0 ? static_cast<size_t>(got) : 0);
  const std::vector<std::string> lines = absl::StrSplit(text, '\n', absl::SkipWhitespace());
  return lines.empty() ? "" : lines.back();
}

}  // namespace

absl::Status LocalCluster::Run(Service& service, std::vector<std::string> arguments, bool show_logs) {
  absl::StatusOr<std::string> program = FindProgram(service.name);
  if (!program.ok()) return program.status();
  arguments.insert(arguments.begin(), *program);
  if (!show_logs) service.log = memfd_create(service.name.c_str(), MFD_CLOEXEC);
  ChildOptions options;
  options.error_descriptor = service.log;
  absl::StatusOr<pid_t> pid = children_->Start(arguments, options);
  if (!pid.ok()) return pid.status();
  service.pid = *pid;
  return absl::OkStatus();
}

absl::Status LocalCluster::Check() const {
  for (const auto& service : services_) {
    const std::string ended = children_->Ended(service->pid);
    if (ended.empty()) continue;
    const std::string words = service->log < 0 ? "" : LastLine(service->log);
    return absl::UnavailableError(
        absl::StrCat(service->name, " ended (", ended, ")", words.empty() ? "" : ": ", words));
  }
  return absl::OkStatus();
}

absl::Status LocalCluster::WaitForEnd() const {
  for (;;) {
    absl::Status status = Check();
    if (!status.ok()) return status;
    children_->WaitForAnyEnd();
  }
}

absl::StatusOr<uint16_t> LocalCluster::WaitForPort(const std::string& file, absl::Time deadline) const {
  while (absl::Now() < deadline) {
    absl::Status alive = Check();
    if (!alive.ok()) return alive;
    // The file appears when it is complete.
    std::ifstream in(file);
    uint32_t port = 0;
    if (in >> port && port <= 65535) return static_cast<uint16_t>(port);
    absl::SleepFor(absl::Milliseconds(2));
  }
  return absl::DeadlineExceededError("the coordinator did not start in time");
}

absl::Status LocalCluster::WaitForServers(uint32_t count, absl::Time deadline) const {
  while (absl::Now() < deadline) {
    absl::StatusOr<std::vector<v1::Server>> servers = client_->ListServers();
    absl::Status alive = Check();
    if (!alive.ok()) return alive;
    if (!servers.ok()) return servers.status();
    const auto registered = std::count_if(servers->begin(), servers->end(),
                                          [](const v1::Server& server) { return server.alive(); });
    if (registered >= count) return absl::OkStatus();
    absl::SleepFor(absl::Milliseconds(5));
  }
  return absl::DeadlineExceededError("the block servers did not start in time");
}

absl::StatusOr<LocalCluster> LocalCluster::Start(const LocalClusterOptions& options,
                                                 ChildProcesses& children) {
  LocalCluster cluster(children);
  const absl::Time deadline = absl::Now() + options.patience;
  if (options.port != 0) {
    absl::Status free = CheckPortIsFree(options.port);
    if (!free.ok()) return free;
  }
  const auto add = [&](const char* name) {
    cluster.services_.push_back(std::shared_ptr<Service>(new Service{name}, [](Service* service) {
      if (service->log >= 0) close(service->log);
      delete service;
    }));
    return cluster.services_.back();
  };
  MadeFiles files;
  absl::StatusOr<std::string> folder = files.MakeTemporaryFolder();
  if (!folder.ok()) return folder.status();
  const std::string port_file = *folder + "/port";
  absl::Status status = cluster.Run(
      *add("ndmap-coordinator"),
      {"--listen", absl::StrCat(kLoopback, ":", options.port), "--port-file", port_file}, options.show_logs);
  if (!status.ok()) return status;
  absl::StatusOr<uint16_t> port = cluster.WaitForPort(port_file, deadline);
  if (!port.ok()) return port.status();
  const std::string address = absl::StrCat(kLoopback, ":", *port);
  for (uint32_t i = 0; i < options.servers; ++i) {
    status = cluster.Run(*add("ndmap-server"),
                         {"--listen", absl::StrCat(kLoopback, ":0"), "--coordinator", address, "--threads",
                          absl::StrCat(options.threads)},
                         options.show_logs);
    if (!status.ok()) return status;
  }
  absl::StatusOr<Client> client = Client::Connect(address);
  if (!client.ok()) {
    absl::Status alive = cluster.Check();
    return alive.ok() ? client.status() : alive;
  }
  cluster.client_ = std::make_unique<Client>(*std::move(client));
  status = cluster.WaitForServers(options.servers, deadline);
  if (!status.ok()) return status;
  return cluster;
}

}  // namespace ndmap::cli
