// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Being written: with UseFlatStorage this will specialise CGAL's storage. Until then both kinds are CGAL's
// own.
