// shape_edge_table.h: edges by their ends, numbered in the order in which they were added.
#ifndef OM_SHAPE_EDGE_TABLE_H
#define OM_SHAPE_EDGE_TABLE_H

#include "omentum/base.h"

typedef struct OmEdgeTable {  // all zero: empty; om__edge_table_done frees
    int (*end)[2];            // ascending                       (nedge x 2)
    int nedge, cap;
    int* slot;  // hash table of edges, -1: free
    int nslot;  // a power of 2
} OmEdgeTable;

void om__edge_table_done(OmEdgeTable* table);
// The number of the edge between two points in either order, or -1.
int om__edge_find(const OmEdgeTable* table, int a, int b);
// Add an edge, unless it is there.
OmStatus om__edge_add(OmEdgeTable* table, int a, int b);

#endif
