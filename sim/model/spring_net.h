/* spring_net.h: springs between nodes, and their energy, gradient and stiffness. The stress that
 * mixed-point Newton keeps is the tension of each spring. */
#ifndef TOILE_MODEL_SPRING_NET_H
#define TOILE_MODEL_SPRING_NET_H

#include "sim/base/arena.h"
#include "sim/model/panel.h"
#include "sim/model/spring_law.h"
#include "sim/solve/block_matrix.h"

typedef struct Spring {
    int a, b, kind; /* only a may be a ghost */
} Spring;

typedef struct SpringNet {
    const SpringKind *kinds;
    int spring_count;
    Spring *springs;    /* (spring_count) */
    int node_limit;     /* nodes from here on are ghosts */
    BlockPlace *places; /* (spring_count x 3) aa, bb, ab; base -1: a ghost */
} SpringNet;

/* Is node (i, j) on a border that runs along `axis`, so that a thread there owns half a width? */
int spring_net_on_border(const Panel *panel, int i, int j, int axis);

/* Springs from every lattice node to that `reach` further along `axis`; of kind + 1 on borders. */
void spring_net_add_threads(SpringNet *net, const Panel *panel, int axis, int reach, int kind);

double spring_net_energy(const SpringNet *net, const double *x);
void spring_net_add_gradient(const SpringNet *net, const double *x, double *gradient);
void spring_net_tension(const SpringNet *net, const double *x, double *tension);
/* tension at the old length plus its slope times the linear change of length */
void spring_net_predict(const SpringNet *net, const double *x_new, const double *dx,
                        double *tension);
int spring_net_couple(const SpringNet *net, int *pairs);
void spring_net_bind(SpringNet *net, const BlockMatrix *matrix, int first, Arena *arena);
void spring_net_add_hessian(const SpringNet *net, const double *x, const double *tension,
                            bool definite, double *values);

#endif
