// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <XmlRpcValue.h>

#include <set>
#include <string>

namespace unirit {

/// Names of the values in a tree of parameters, those of nested ones joined by "/".
std::set<std::string> leafNames(XmlRpc::XmlRpcValue tree);

/// The known name that an unknown one was meant to be: misspelt by a few letters, or given
/// without its namespace. Empty where none is near.
std::string nearestName(const std::string& unknown, const std::set<std::string>& known);

/// Whether nobody but the node has use for this name: its namespace is one of a known name's.
bool isInNamespaceOf(const std::string& name, const std::set<std::string>& known);

}  // namespace unirit
