//! Parts of a drawing without links between them: found, and put side by side on shelves.

use crate::base::geometry::{Point, Size};
use crate::layout::{Link, Plan};

/// The room between parts in millimetres.
pub(crate) const PARTED: f64 = 3.0;

/// The corners of parts on shelves, the highest parts first, and the size of all.
pub(crate) fn shelves(sizes: &[Size], width: f64) -> (Vec<Point>, Size) {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|a, b| sizes[*b].h.total_cmp(&sizes[*a].h).then(a.cmp(b)));
    let mut corners = vec![Point::default(); sizes.len()];
    let (mut x, mut y, mut high, mut wide) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for at in order {
        let size = sizes[at];
        if x > 0.0 && x + size.w > width {
            (x, y, high) = (0.0, y + high + PARTED * 0.7, 0.0);
        }
        corners[at] = Point::new(x, y);
        high = high.max(size.h);
        wide = wide.max(x + size.w);
        x += size.w + PARTED;
    }
    (corners, Size::new(wide, y + high))
}

/// Some vertices with all that links them, or frames them together.
pub(crate) struct MapPart {
    pub(crate) vertices: Vec<usize>,
    pub(crate) links: Vec<usize>,
    pub(crate) clusters: Vec<usize>,
}

/// The parts of a plan, in the order of their first vertices.
pub(crate) fn parts(plan: &Plan) -> Vec<MapPart> {
    let mut of: Vec<usize> = (0..plan.vertices.len()).collect();
    let clusters = plan.clusters.len();
    loop {
        let mut frame: Vec<usize> = vec![usize::MAX; clusters];
        let before = of.clone();
        for link in &plan.links {
            let least = of[link.from].min(of[link.to]);
            (of[link.from], of[link.to]) = (least, least);
        }
        for (at, vertex) in plan.vertices.iter().enumerate() {
            if let Some(own) = vertex.cluster.and_then(|c| frame.get_mut(c)) {
                *own = (*own).min(of[at]);
            }
        }
        for (at, vertex) in plan.vertices.iter().enumerate() {
            if let Some(own) = vertex.cluster.and_then(|c| frame.get(c)) {
                of[at] = of[at].min(*own);
            }
        }
        if of == before {
            break;
        }
    }
    let mut roots = of.clone();
    roots.sort_unstable();
    roots.dedup();
    let part = |root: usize| MapPart {
        vertices: (0..of.len()).filter(|at| of[*at] == root).collect(),
        links: (0..plan.links.len())
            .filter(|at| of[plan.links[*at].from] == root)
            .collect(),
        clusters: (0..clusters)
            .filter(|c| {
                (0..of.len()).any(|at| of[at] == root && plan.vertices[at].cluster == Some(*c))
            })
            .collect(),
    };
    roots.into_iter().map(part).collect()
}

impl MapPart {
    pub(crate) fn plan(&self, whole: &Plan) -> Plan {
        let new = |old: usize| self.vertices.binary_search(&old).unwrap_or(0);
        let mut plan = Plan::default();
        for at in &self.vertices {
            let mut vertex = whole.vertices[*at].clone();
            vertex.cluster = vertex
                .cluster
                .and_then(|c| self.clusters.binary_search(&c).ok());
            plan.vertices.push(vertex);
        }
        for at in &self.links {
            let link = whole.links[*at];
            plan.links.push(Link {
                from: new(link.from),
                to: new(link.to),
                label: None,
            });
        }
        plan.clusters = self
            .clusters
            .iter()
            .map(|c| whole.clusters[*c].clone())
            .collect();
        plan
    }

    pub(crate) fn labels(&self, all: &[Vec<Size>]) -> Vec<Vec<Size>> {
        let own = self.links.iter().filter_map(|at| all.get(*at));
        own.cloned().collect()
    }
}
