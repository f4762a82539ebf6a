// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/client.h"

#include "absl/strings/str_cat.h"
#include "client/sdk/connection.h"

namespace ndmap {
namespace {

using CoordinatorStub = v1::Coordinator::Stub;

template <class Request, class Response>
absl::Status Idempotent(internal::Connection& connection,
                        grpc::Status (CoordinatorStub::*method)(grpc::ClientContext*, const Request&,
                                                                Response*),
                        const Request& request, Response* response) {
  return internal::CallIdempotent(connection.coordinator(), method, request, response, connection.options(),
                                  connection.coordinator_name());
}

template <class T>
std::vector<T> Taken(google::protobuf::RepeatedPtrField<T>* field) {
  return std::vector<T>(std::make_move_iterator(field->begin()), std::make_move_iterator(field->end()));
}

}  // namespace

absl::StatusOr<Client> Client::Connect(const std::string& target, const ClientOptions& options) {
  absl::Status status = internal::CheckTarget(target);
  if (!status.ok()) return status;
  auto connection = std::make_shared<internal::Connection>(target, options);
  v1::GetVersionRequest request;
  *request.mutable_caller() = internal::SdkVersion();
  v1::GetVersionResponse response;
  status = internal::CallOnce(connection->coordinator(), &CoordinatorStub::GetVersion, request, &response,
                              options.connect_timeout, connection->coordinator_name());
  if (!status.ok()) return status;
  if (response.version().protocol() != v1::PROTOCOL_CURRENT) {
    return absl::FailedPreconditionError(absl::StrCat(connection->coordinator_name(), " speaks protocol ",
                                                      response.version().protocol(), ", this client ",
                                                      int{v1::PROTOCOL_CURRENT}));
  }
  return Client(std::move(connection), std::move(*response.mutable_version()));
}

const std::string& Client::target() const { return connection_->target(); }

absl::StatusOr<std::vector<v1::Server>> Client::ListServers() const {
  v1::ListServersResponse response;
  absl::Status status =
      Idempotent(*connection_, &CoordinatorStub::ListServers, v1::ListServersRequest(), &response);
  if (!status.ok()) return status;
  return Taken(response.mutable_servers());
}

absl::StatusOr<v1::ProcessStats> Client::CoordinatorStats() const {
  v1::GetProcessStatsResponse response;
  absl::Status status =
      Idempotent(*connection_, &CoordinatorStub::GetProcessStats, v1::GetProcessStatsRequest(), &response);
  if (!status.ok()) return status;
  return std::move(*response.mutable_stats());
}

absl::Status Client::DeleteSurface(const std::string& surface_id) const {
  v1::DeleteSurfaceRequest request;
  request.set_surface_id(surface_id);
  v1::DeleteSurfaceResponse response;
  return internal::CallOnce(connection_->coordinator(), &CoordinatorStub::DeleteSurface, request, &response,
                            connection_->options().call_timeout, connection_->coordinator_name());
}

absl::StatusOr<JobHandle> Client::CreateMap(const v1::CreateMapRequest& request) const {
  v1::CreateMapResponse response;
  // The coordinator partitions the grid and hands the surface to the servers before it answers.
  absl::Status status =
      internal::CallOnce(connection_->coordinator(), &CoordinatorStub::CreateMap, request, &response,
                         connection_->options().transfer_timeout, connection_->coordinator_name());
  if (!status.ok()) return status;
  return JobHandle(connection_, response.job().job());
}

absl::StatusOr<std::vector<v1::Map>> Client::ListMaps() const {
  v1::ListMapsResponse response;
  absl::Status status =
      Idempotent(*connection_, &CoordinatorStub::ListMaps, v1::ListMapsRequest(), &response);
  if (!status.ok()) return status;
  return Taken(response.mutable_maps());
}

absl::StatusOr<MapHandle> Client::OpenMap(const std::string& name) const {
  v1::GetMapRequest request;
  request.set_map(name);
  v1::GetMapResponse response;
  absl::Status status = Idempotent(*connection_, &CoordinatorStub::GetMap, request, &response);
  if (!status.ok()) return status;
  return MapHandle(connection_, std::move(*response.mutable_map()));
}

absl::Status Client::DeleteMap(const std::string& name) const {
  v1::DeleteMapRequest request;
  request.set_map(name);
  v1::DeleteMapResponse response;
  return internal::CallOnce(connection_->coordinator(), &CoordinatorStub::DeleteMap, request, &response,
                            connection_->options().call_timeout, connection_->coordinator_name());
}

absl::StatusOr<std::vector<v1::Job>> Client::ListJobs(const std::string& map) const {
  v1::ListJobsRequest request;
  request.set_map(map);
  v1::ListJobsResponse response;
  absl::Status status = Idempotent(*connection_, &CoordinatorStub::ListJobs, request, &response);
  if (!status.ok()) return status;
  return Taken(response.mutable_jobs());
}

}  // namespace ndmap
