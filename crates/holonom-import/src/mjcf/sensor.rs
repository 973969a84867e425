//! `<sensor>`: what has a counterpart in `[[sensor]]`.

use std::collections::{BTreeMap, BTreeSet};

use holonom_model::SensorKind;
use nalgebra::{Isometry3, Translation3};

use super::equality::missing;
use super::tendon::Tendons;
use crate::element::XmlElement;
use crate::remark::Remarks;
use crate::robot::{GaugeOf, NamedFrame, RobotLink, RobotSensor};
use crate::source::{Refusal, Result};

const OTHERS: &str = "sensors without a counterpart: not translated";

/// What sensors name.
pub(crate) struct Named<'a> {
    links: BTreeMap<&'a str, (usize, &'a RobotLink)>,
    joints: BTreeSet<&'a str>,
    sites: BTreeMap<&'a str, &'a NamedFrame>,
}

impl<'a> Named<'a> {
    pub(crate) fn new(links: &'a [RobotLink], sites: &'a [NamedFrame]) -> Self {
        let joints = links.iter().flat_map(|link| &link.joints);
        Self {
            links: links.iter().enumerate().map(|(k, l)| (l.name.as_str(), (k, l))).collect(),
            joints: joints.map(|joint| joint.name.as_str()).collect(),
            sites: sites.iter().map(|site| (site.name.as_str(), site)).collect(),
        }
    }

    /// The sensors of a file.
    pub(crate) fn gauges(
        &self,
        root: &XmlElement,
        tendons: &mut Tendons,
        remarks: &mut Remarks,
    ) -> Result<Vec<RobotSensor>> {
        let mut gauges = Vec::new();
        for element in root.all("sensor").flat_map(|own| &own.children) {
            let Some(gauge) = self.gauge(element, tendons)? else {
                remarks.add(OTHERS, element);
                continue;
            };
            gauges.push(gauge);
        }
        Ok(gauges)
    }

    fn gauge(&self, element: &XmlElement, tendons: &mut Tendons) -> Result<Option<RobotSensor>> {
        let kind = match element.name.as_str() {
            "jointpos" => SensorKind::JointCoordinate,
            "jointvel" => SensorKind::JointRate,
            "tendonpos" => SensorKind::Distance,
            "tendonvel" => SensorKind::DistanceRate,
            "framepos" => SensorKind::Position,
            "framequat" => SensorKind::Orientation,
            "framelinvel" => SensorKind::Velocity,
            "frameangvel" => SensorKind::AngularVelocity,
            "accelerometer" | "gyro" => SensorKind::Imu,
            _ => return Ok(None),
        };
        let of = match kind {
            SensorKind::JointCoordinate | SensorKind::JointRate => {
                let joint = element.required("joint")?;
                if !self.joints.contains(joint) {
                    return Err(missing(element, "joint", "joint", joint));
                }
                GaugeOf::Joint(joint.to_owned())
            }
            SensorKind::Distance | SensorKind::DistanceRate => {
                let name = element.required("tendon")?;
                let tendon = tendons.named(name);
                tendon.ok_or_else(|| missing(element, "tendon", "tendon", name))?.is_read = true;
                GaugeOf::Tendon(name.to_owned())
            }
            SensorKind::Imu => GaugeOf::Frame(self.site(element, "site")?.clone()),
            _ => match self.frame(element, kind)? {
                Some(frame) => GaugeOf::Frame(frame),
                None => return Ok(None),
            },
        };
        let own = element.word("name").map(str::to_owned);
        let name = own.unwrap_or_else(|| format!("{}_{}", element.name, of.name()));
        let place = element.place.clone();
        Ok(Some(RobotSensor { name, kind, of, label: element.label(), place }))
    }

    /// The frame of a `frame…` sensor, seen from space; `None` without a counterpart.
    fn frame(&self, element: &XmlElement, kind: SensorKind) -> Result<Option<NamedFrame>> {
        if element.word("reftype").is_some() {
            return Ok(None);
        }
        let of = element.required("objname")?;
        let link = || {
            let found = self.links.get(of).copied();
            found.ok_or_else(|| missing(element, "objname", "body", of))
        };
        let frame = |number: usize, pose: Isometry3<f64>| NamedFrame {
            name: of.to_owned(),
            link: Some(number),
            pose,
        };
        Ok(match element.required("objtype")? {
            "site" => Some(self.site(element, "objname")?.clone()),
            "xbody" => Some(frame(link()?.0, Isometry3::identity())),
            // at the centre of mass, along the principal axes
            "body" if kind == SensorKind::Orientation => None,
            "body" => {
                let (number, own) = link()?;
                Some(frame(number, Translation3::from(own.mass.center).into()))
            }
            "geom" | "camera" => None,
            other => {
                let message = format!("`objtype` is `{}`", other.escape_debug());
                let help = "write body, xbody, geom, site or camera";
                return Err(Refusal::at(element.place_of("objtype"), message, help));
            }
        })
    }

    fn site(&self, element: &XmlElement, attribute: &str) -> Result<&NamedFrame> {
        let name = element.required(attribute)?;
        let found = self.sites.get(name).copied();
        found.ok_or_else(|| missing(element, attribute, "site", name))
    }
}
