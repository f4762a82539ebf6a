// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of maps on a cluster of real services, for tests.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/map/ids.h"
#include "tests/service/cluster.h"

namespace ndmap {

// Cells for the oracle "list": a corner of the grid down to level 3, others less deep.
inline constexpr char kRefined[] = "h0 h0/7 h0/7.0 h5 h5/2 h6/1 h6 h6/1.3";

// One value as text: the same text for the same bits.
inline std::string ValueText(const v1::Values& values, int k) {
  if (values.codes_size() > 0) return values.categories(static_cast<int>(values.codes(k)));
  if (values.integers_size() > 0) return absl::StrCat(values.integers(k));
  return absl::StrCat(absl::Hex(std::bit_cast<uint64_t>(values.doubles(k))));
}

// By cell, the values by name, one text each (of a vec3 three).
using Table = std::map<CellId, std::vector<std::string>>;

class AttributeCluster : public Cluster {
 public:
  using Cluster::Cluster;

  static v1::Attribute Attribute(const std::string& name, uint32_t dimension, v1::ValueType type,
                                 v1::SplitRule split = v1::SPLIT_RULE_COPY) {
    v1::Attribute attribute;
    attribute.set_name(name);
    attribute.set_dimension(dimension);
    attribute.set_type(type);
    attribute.set_split(split);
    return attribute;
  }
  grpc::Status StartDefine(const std::string& map, const v1::Attribute& attribute, uint64_t* job) {
    grpc::ClientContext context;
    v1::DefineAttributeRequest request;
    request.set_map(map);
    *request.mutable_attribute() = attribute;
    v1::DefineAttributeResponse response;
    const grpc::Status status = stub().DefineAttribute(&context, request, &response);
    *job = response.job().job();
    return status;
  }
  v1::Job Define(const std::string& map, const v1::Attribute& attribute) {
    uint64_t job = 0;
    const grpc::Status status = StartDefine(map, attribute, &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return status.ok() ? Await(job) : v1::Job();
  }
  grpc::Status StartDrop(const std::string& map, const std::string& name, uint64_t* job) {
    grpc::ClientContext context;
    v1::DropAttributeRequest request;
    request.set_map(map);
    request.set_name(name);
    v1::DropAttributeResponse response;
    const grpc::Status status = stub().DropAttribute(&context, request, &response);
    *job = response.job().job();
    return status;
  }
  v1::Map Get(const std::string& map) {
    grpc::ClientContext context;
    v1::GetMapRequest request;
    request.set_map(map);
    v1::GetMapResponse response;
    EXPECT_TRUE(stub().GetMap(&context, request, &response).ok());
    return response.map();
  }

  static v1::ReadAttributesRequest All(const std::string& map, uint32_t dimension,
                                       const std::vector<std::string>& names) {
    v1::ReadAttributesRequest request;
    request.set_map(map);
    request.set_dimension(dimension);
    for (const std::string& name : names) request.add_names(name);
    request.mutable_select()->mutable_all();
    return request;
  }
  // By way of the server of `block`. Cells in the order in which they came, missing ones without values.
  grpc::Status Read(const v1::ReadAttributesRequest& request, uint32_t block,
                    std::vector<std::pair<CellId, std::vector<std::string>>>* rows) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    auto server = ServerOf(request.map(), block);
    auto reader = server->ReadAttributes(&context, request);
    v1::ReadAttributesResponse part;
    while (reader->Read(&part)) {
      EXPECT_EQ(part.cell_hi_size(), part.cell_lo_size());
      EXPECT_EQ(part.columns_size(), request.names_size());
      const size_t first = rows->size();
      for (int i = 0; i < part.cell_hi_size(); ++i) {
        auto& row = rows->emplace_back(CellId::FromWords(part.cell_hi(i), part.cell_lo(i)),
                                       std::vector<std::string>());
        for (const v1::Values& column : part.columns()) {
          const int width = column.doubles_size() == 3 * part.cell_hi_size() ? 3 : 1;
          for (int c = 0; c < width; ++c) row.second.push_back(ValueText(column, i * width + c));
        }
      }
      for (uint32_t place : part.missing()) (*rows)[first + place].second.clear();
    }
    return reader->Finish();
  }
  // Every cell once.
  Table ReadTable(const v1::ReadAttributesRequest& request, uint32_t block = 0) {
    std::vector<std::pair<CellId, std::vector<std::string>>> rows;
    const grpc::Status status = Read(request, block, &rows);
    EXPECT_TRUE(status.ok()) << status.error_message();
    Table table(rows.begin(), rows.end());
    EXPECT_EQ(table.size(), rows.size()) << "a cell came twice";
    return table;
  }

  static void AddIds(const std::vector<CellId>& ids, v1::CellSelection::Ids* wire) {
    for (const CellId& id : ids) {
      wire->add_hi(id.hi());
      wire->add_lo(id.lo());
    }
  }
  grpc::Status Write(const std::vector<v1::WriteAttributeRequest>& parts,
                     v1::WriteAttributeResponse* response, uint32_t block = 0) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    auto server = ServerOf(parts.front().map(), block);
    auto writer = server->WriteAttribute(&context, response);
    for (const v1::WriteAttributeRequest& part : parts) {
      if (!writer->Write(part)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }
  static v1::WriteAttributeRequest Part(const std::string& map, const std::string& name,
                                        const std::vector<CellId>& ids) {
    v1::WriteAttributeRequest part;
    part.set_map(map);
    part.set_name(name);
    AddIds(ids, part.mutable_ids());
    return part;
  }

  grpc::Status Aggregate(const v1::AggregateRequest& request, v1::AggregateResponse* response,
                         uint32_t block = 0) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    return ServerOf(request.map(), block)->Aggregate(&context, request, response);
  }
  v1::AggregateResponse MustAggregate(const v1::AggregateRequest& request, uint32_t block = 0) {
    v1::AggregateResponse response;
    const grpc::Status status = Aggregate(request, &response, block);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  // What the stores of all blocks hold of a column, also of cells that count elsewhere: every value that a
  // cell has anywhere.
  std::map<CellId, std::vector<std::string>> InEveryBlock(const std::string& map, unsigned dimension,
                                                          const std::string& name) {
    std::map<CellId, std::vector<std::string>> values;
    for (size_t s = 0; s < size(); ++s) {
      absl::StatusOr<server::BlockHost::MapInfo> info = server(s).host().Info(map);
      if (!info.ok()) continue;
      for (uint32_t b : info->blocks) {
        const auto look = [&](Block3&, AttributeStore& store) {
          const AttributeTable& table = store.table(dimension);
          const Column* column = table.Find(name);
          EXPECT_NE(column, nullptr);
          for (uint32_t row = 0; column != nullptr && row < table.size(); ++row) {
            const ValueWords v = column->Get(row);
            const bool category = column->definition().type == ValueType::kCategory;
            values[table.id(row)].push_back(
                category ? column->Text(v[0])
                         : absl::StrCat(absl::Hex(v[0]), " ", absl::Hex(v[1]), " ", absl::Hex(v[2])));
          }
          return absl::OkStatus();
        };
        EXPECT_TRUE(server(s).host().Query(map, b, look).ok());
      }
    }
    return values;
  }
  // How many blocks have the cell, at most; all of them with one value.
  size_t ExpectOneValueEverywhere(const std::string& map, unsigned dimension, const std::string& name) {
    size_t most = 0;
    for (const auto& [id, values] : InEveryBlock(map, dimension, name)) {
      most = std::max(most, values.size());
      for (const std::string& value : values) EXPECT_EQ(value, values.front()) << id.ToString();
    }
    return most;
  }
};

inline std::vector<CellId> IdsOf(const Table& table) {
  std::vector<CellId> ids;
  for (const auto& [id, values] : table) ids.push_back(id);
  return ids;
}

// Values that follow from the cell and a salt, whoever writes them.
inline v1::Values ValuesFor(const std::vector<CellId>& ids, v1::ValueType type, uint64_t salt) {
  v1::Values values;
  for (int k = 0; type == v1::VALUE_TYPE_CATEGORY && k < 5; ++k)
    values.add_categories(absl::StrCat("kind ", k));
  for (const CellId& id : ids) {
    std::mt19937_64 random(id.hi() * 31 + id.lo() * 17 + salt);
    const auto real = [&] { return std::ldexp(static_cast<double>(random() >> 11), -45) - 100; };
    if (type == v1::VALUE_TYPE_INT64) values.add_integers(static_cast<int64_t>(random()) >> 20);
    if (type == v1::VALUE_TYPE_CATEGORY) values.add_codes(static_cast<uint32_t>(random() % 5));
    if (type == v1::VALUE_TYPE_DOUBLE || type == v1::VALUE_TYPE_VEC3) values.add_doubles(real());
    for (int c = 1; type == v1::VALUE_TYPE_VEC3 && c < 3; ++c) values.add_doubles(real());
  }
  return values;
}

}  // namespace ndmap
